/** Numbers and names as people read them. */

import type { UploadProgress } from "../client/api";
import { formatDecimal } from "../i18n/number-format";
import { joinList, translate } from "../i18n/translator";

/** What turns the direction of writing, until it is ended. */
const BIDI_CONTROLS = /[\u202a-\u202e\u2066-\u2069]/;

/** A name that others gave, within other words: what turns in it turns nothing beside it. */
export function isolateBidi(name: string): string {
  return BIDI_CONTROLS.test(name) ? `\u2068${name}\u2069` : name;
}

/** Seconds as m:ss, or h:mm:ss. */
export function formatDuration(seconds: number): string {
  const whole = Math.max(0, Math.floor(Number.isFinite(seconds) ? seconds : 0));
  const [h, m, s] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  const tail = String(s).padStart(2, "0");
  return h > 0 ? `${h}:${String(m).padStart(2, "0")}:${tail}` : `${m}:${tail}`;
}

/** Bytes as kB or MB with one decimal, powers of 1000. */
export function formatBytes(bytes: number): string {
  return bytes < 1e6 ? `${formatDecimal(bytes / 1e3, bytes < 1e4 ? 1 : 0)} kB` : `${formatDecimal(bytes / 1e6, 1)} MB`;
}

/** What an upload's last row says: how far it is, and how long it will take at the speed so far. */
export function formatUploadProgress(loaded: number, total: number, seconds: number): string {
  const share = translate("{part} of {whole}", { part: formatBytes(loaded), whole: formatBytes(total) });
  if (loaded >= total) return joinList([share, translate("reading the dance")]);
  if (seconds < 0.5 || loaded <= 0) return share;
  return joinList([
    share,
    translate("{seconds} s left", { seconds: formatDecimal(Math.max(1, ((total - loaded) / loaded) * seconds), 0) }),
  ]);
}

/** What the server does with an upload, in words. */
export function formatIngestStage(stage: UploadProgress["stage"]): string {
  return translate(
    (
      {
        sending: "sending",
        waiting: "waiting for its turn",
        reading: "reading the dance",
        encoding: "encoding the dance",
      } as const
    )[stage],
  );
}

/** A number with a sensible count of digits: 3.45, 12.3, 184. */
export function formatFigure(value: number): string {
  if (!Number.isFinite(value)) return "-";
  const size = Math.abs(value);
  return formatDecimal(value, size < 10 ? 2 : size < 100 ? 1 : 0);
}

/** First letter of a name, for an avatar. */
export function initialOf(name: string): string {
  const [first] = name.trim();
  return (first ?? "?").toLocaleUpperCase();
}

/** A file name without its ending, with spaces for underscores: the piece's name where it has no other. */
export function motionNameFromFile(filename: string): string {
  const bare = filename
    .replace(/\.[^.]+$/, "")
    .replace(/[_]+/g, " ")
    .trim();
  return bare || filename;
}
