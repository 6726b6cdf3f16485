/** Formatting of numbers, durations and names for display. */

import type { UploadProgress } from "../client/api";
import { formatDecimal } from "../i18n/number-format";
import { joinList, translate } from "../i18n/translator";

/** Format seconds as m:ss, or h:mm:ss. */
export function formatDuration(seconds: number): string {
  const whole = Math.max(0, Math.floor(Number.isFinite(seconds) ? seconds : 0));
  const [h, m, s] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  const tail = String(s).padStart(2, "0");
  return h > 0 ? `${h}:${String(m).padStart(2, "0")}:${tail}` : `${m}:${tail}`;
}

/** Format bytes as kB or MB, with powers of 1000. */
export function formatBytes(bytes: number): string {
  return bytes < 1e6 ? `${formatDecimal(bytes / 1e3, bytes < 1e4 ? 1 : 0)} kB` : `${formatDecimal(bytes / 1e6, 1)} MB`;
}

/** Describe an upload's progress: bytes sent, and the remaining time at the mean speed so far. */
export function formatUploadProgress(loaded: number, total: number, seconds: number): string {
  const share = translate("{part} of {whole}", { part: formatBytes(loaded), whole: formatBytes(total) });
  if (loaded >= total) return joinList([share, translate("reading the dance")]);
  if (seconds < 0.5 || loaded <= 0) return share;
  return joinList([
    share,
    translate("{seconds} s left", { seconds: formatDecimal(Math.max(1, ((total - loaded) / loaded) * seconds), 0) }),
  ]);
}

/** Name the stage of the server's work on an upload. */
export function formatIngestStage(stage: UploadProgress["stage"]): string {
  return translate(
    (
      {
        sending: "sending",
        preparing: "preparing this server, only once",
        waiting: "queued",
        reading: "reading the dance",
        encoding: "encoding the dance",
      } as const
    )[stage],
  );
}

/** Format a number with three significant digits where they matter: 3.45, 12.3, 184. */
export function formatFigure(value: number): string {
  if (!Number.isFinite(value)) return "-";
  const magnitude = Math.abs(value);
  return formatDecimal(value, magnitude < 10 ? 2 : magnitude < 100 ? 1 : 0);
}

/** Return the first letter of a name, in upper case. */
export function initialOf(name: string): string {
  const [first] = name.trim();
  return (first ?? "?").toLocaleUpperCase();
}

/** Derive a motion's name from its file name: without the extension, and with spaces instead of underscores. */
export function motionNameFromFile(filename: string): string {
  const bare = filename
    .replace(/\.[^.]+$/, "")
    .replace(/[_]+/g, " ")
    .trim();
  return bare || filename;
}
