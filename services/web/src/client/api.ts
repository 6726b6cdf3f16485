/** Motions and sessions over HTTP (`proto/SPEC.md`, HTTP). */

import { type Access, authorization, pageAccess, refusedWith } from "./access";
import { ProblemError } from "./problem";

/** A motion as the server describes it; what more it says is kept. */
export interface Motion {
  id: string;
  name: string;
  filename: string;
  created: string;
  /** Seconds. */
  duration: number;
  fps: number;
  /** The types of its tracks. */
  tracks?: string[];
  /** How many dance in it; left out: one. Of several also what each of them dances, by name. */
  performers?: number;
  pieces?: string[];
  /** Of a motion that was kept from a session: words of where it is from, and its dance's id. */
  source?: string;
  kept_from?: string;
  [key: string]: unknown;
}

/** A session; `position` and `duration` in microseconds, `limbs` the holder's id or null for each of every performer's. */
export interface Session {
  id: string;
  motion: string;
  playing: boolean;
  loop: boolean;
  position: number;
  duration: number;
  epoch: number;
  viewers: number;
  puppeteers: { id: string; name: string; colour: number }[];
  limbs: (string | null)[];
}

/** Edits of a session's timeline; `position` in microseconds. */
export interface SessionEdit {
  playing?: boolean;
  position?: number;
  loop?: boolean;
  motion?: string;
}

/**
 * Where a camera stood: `time` on the reference clock in microseconds, `position` and the point gazed at in metres in the
 * dance's frame, the vertical field of view in radians.
 */
export interface CameraKeyframe {
  time: number;
  position: [number, number, number];
  gaze: [number, number, number];
  fov: number;
}

/** What to keep of a session: the last `seconds` of what it showed, or all that can be kept, with camera moves if any. */
export interface Recording {
  name?: string;
  seconds?: number;
  camera?: readonly CameraKeyframe[];
}

/** One page of a list, and the cursor of the next. */
export interface Page<T> {
  items: T[];
  next: string | null;
}

/** Motions, newest first. */
export function listMotions(cursor?: string): Promise<Page<Motion>> {
  return requestJson("GET", `/v1/motions${cursorQuery(cursor)}`) as Promise<Page<Motion>>;
}

/** Removes a motion. */
export async function deleteMotion(id: string): Promise<void> {
  await requestJson("DELETE", `/v1/motions/${encodeURIComponent(id)}`);
}

/** A new motion: `motion` with those who dance in `motions` beside its own, in a row. There may be four in all. */
export function addPerformers(motion: string, motions: readonly string[], access = pageAccess): Promise<Motion> {
  return requestJson(
    "POST",
    `/v1/motions/${encodeURIComponent(motion)}/performers`,
    { motions },
    access,
  ) as Promise<Motion>;
}

/** A new session over a motion. */
export function createSession(motion: string): Promise<Session> {
  return requestJson("POST", "/v1/sessions", { motion }) as Promise<Session>;
}

/** Sessions. */
export function listSessions(cursor?: string, access = pageAccess): Promise<Page<Session>> {
  return requestJson("GET", `/v1/sessions${cursorQuery(cursor)}`, undefined, access) as Promise<Page<Session>>;
}

/** One session. */
export function getSession(id: string): Promise<Session> {
  return requestJson("GET", `/v1/sessions/${encodeURIComponent(id)}`) as Promise<Session>;
}

/** Plays, pauses, seeks, loops, or changes the motion, for everyone. */
export function editSession(id: string, edit: SessionEdit, access = pageAccess): Promise<Session> {
  return requestJson("PATCH", `/v1/sessions/${encodeURIComponent(id)}`, edit, access) as Promise<Session>;
}

/** Keeps what a session has shown as a new motion; resolves when it can be watched, with seconds of work done. */
export function recordSession(session: string, recording: Recording = {}): Promise<Motion> {
  return requestJson("POST", `/v1/sessions/${encodeURIComponent(session)}/recordings`, recording) as Promise<Motion>;
}

/** A link by which others may watch a session, as what follows the page's address. */
export async function shareSession(session: string): Promise<string> {
  return ((await requestJson("POST", "/v1/shares", { session })) as { link: string }).link;
}

/** Where an upload is: on its way, or in the server's hands; and the share of that which is done, 0..1. */
export interface UploadProgress {
  stage: "sending" | "waiting" | "reading" | "encoding";
  share: number;
}

/** Milliseconds between two questions how far the server is with an upload. */
export const PROGRESS_INTERVAL_MS = 400;

/**
 * Uploads a motion capture file. `onProgress` is told how far it is: fetch cannot say what is sent, so this is an
 * XMLHttpRequest; what the server does then is asked for. Cancelled by `signal`, it rejects with the signal's reason.
 *
 * @throws ProblemError
 */
export function uploadMotion(
  file: File,
  onProgress?: (progress: UploadProgress) => void,
  signal?: AbortSignal,
): Promise<Motion> {
  return new Promise((resolve, reject) => {
    signal?.throwIfAborted();
    const upload = randomName();
    const sending = new XMLHttpRequest();
    const ended = new AbortController();
    const cancel = () => sending.abort();
    signal?.addEventListener("abort", cancel, { once: true });
    sending.upload.addEventListener("progress", ({ loaded, total }) => {
      onProgress?.({ stage: "sending", share: total > 0 ? loaded / total : 0 });
    });
    sending.upload.addEventListener("load", () => {
      if (onProgress) void pollProgress(upload, onProgress, ended.signal);
    });
    sending.addEventListener("loadend", () => {
      ended.abort();
      signal?.removeEventListener("abort", cancel);
    });
    sending.addEventListener("abort", () => reject(signal?.reason as Error));
    sending.addEventListener("error", () => reject(ProblemError.unreachable()));
    sending.addEventListener("load", () => {
      if (sending.status >= 300) reject(refusedWith(ProblemError.from(sending.status, sending.responseText)));
      else resolve(JSON.parse(sending.responseText) as Motion);
    });
    sending.open("POST", `/v1/motions?filename=${encodeURIComponent(file.name)}&upload=${upload}`);
    sending.setRequestHeader("Content-Type", "application/octet-stream");
    for (const [name, value] of Object.entries(authorization())) sending.setRequestHeader(name, value);
    sending.send(file);
  });
}

/** Tells what the server does with an upload, until `ended`. What fails in this is no matter: the upload's own answer tells. */
async function pollProgress(
  upload: string,
  onProgress: (progress: UploadProgress) => void,
  ended: AbortSignal,
): Promise<void> {
  while (!ended.aborted) {
    const said = (await requestJson("GET", `/v1/uploads/${upload}`).catch(() => null)) as
      | UploadProgress
      | { stage: "receiving" }
      | null;
    if (ended.aborted) return;
    if (said && said.stage !== "receiving") onProgress(said);
    await new Promise((resolve) => setTimeout(resolve, PROGRESS_INTERVAL_MS));
  }
}

/** 32 hexadecimal digits. `crypto.randomUUID` is not there on a page without TLS. */
function randomName(): string {
  return Array.from(crypto.getRandomValues(new Uint8Array(16)), (byte) => byte.toString(16).padStart(2, "0")).join("");
}

function cursorQuery(cursor: string | undefined): string {
  return cursor === undefined ? "" : `?cursor=${encodeURIComponent(cursor)}`;
}

async function requestJson(
  method: string,
  path: string,
  body?: unknown,
  access: Access = pageAccess,
): Promise<unknown> {
  const sent =
    body === undefined ? {} : { headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) };
  const said = await (await access.request(access.server + path, { method, ...sent })).text();
  return said === "" ? null : JSON.parse(said);
}
