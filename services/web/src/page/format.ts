/** Numbers and names as people read them. */

import type { UploadProgress } from "../client/library";
import { decimal } from "../words/numbers";
import { series, say } from "../words/say";

/** What turns the direction of writing, until it is ended. */
const TURNS = /[\u202a-\u202e\u2066-\u2069]/;

/** A name that others gave, within other words: what turns in it turns nothing beside it. */
export function isolated(name: string): string {
  return TURNS.test(name) ? `\u2068${name}\u2069` : name;
}

/** Seconds as m:ss, or h:mm:ss. */
export function clockTime(seconds: number): string {
  const whole = Math.max(0, Math.floor(Number.isFinite(seconds) ? seconds : 0));
  const [h, m, s] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  const tail = String(s).padStart(2, "0");
  return h > 0 ? `${h}:${String(m).padStart(2, "0")}:${tail}` : `${m}:${tail}`;
}

/** Bytes as kB or MB with one decimal, powers of 1000. */
export function byteCount(bytes: number): string {
  return bytes < 1e6 ? `${decimal(bytes / 1e3, bytes < 1e4 ? 1 : 0)} kB` : `${decimal(bytes / 1e6, 1)} MB`;
}

/** What an upload's last row says: how far it is, and how long it will take at the speed so far. */
export function uploadProgress(loaded: number, total: number, seconds: number): string {
  const share = say("{part} of {whole}", { part: byteCount(loaded), whole: byteCount(total) });
  if (loaded >= total) return series([share, say("reading the dance")]);
  if (seconds < 0.5 || loaded <= 0) return share;
  return series([share, say("{seconds} s left", { seconds: decimal(Math.max(1, ((total - loaded) / loaded) * seconds), 0) })]);
}

/** What the server does with an upload, in words. */
export function makingProgress(stage: UploadProgress["stage"]): string {
  return say(({ sending: "sending", waiting: "waiting for its turn", reading: "reading the dance", encoding: "encoding the dance" } as const)[stage]);
}

/** A number with a sensible count of digits: 3.45, 12.3, 184. */
export function figure(value: number): string {
  if (!Number.isFinite(value)) return "-";
  const size = Math.abs(value);
  return decimal(value, size < 10 ? 2 : size < 100 ? 1 : 0);
}

/** First letter of a name, for an avatar. */
export function initial(name: string): string {
  const [first] = name.trim();
  return (first ?? "?").toLocaleUpperCase();
}

/** A file name without its ending, with spaces for underscores: the piece's name where it has no other. */
export function pieceName(filename: string): string {
  const bare = filename.replace(/\.[^.]+$/, "").replace(/[_]+/g, " ").trim();
  return bare || filename;
}
