/** HTTP API for motions and sessions (`proto/http.md`). */

import { pageTranslator } from "../i18n/translator";
import type { CrowdPresence, PropPresence } from "../wire/messages";
import { type Access, pageAccess } from "./access";
import { sendFile } from "./file-upload";

/** Motion as described by the server; further members are kept. */
export interface Motion {
  id: string;
  name: string;
  filename: string;
  created: string;
  /** Duration in seconds. */
  duration: number;
  fps: number;
  /** Types of its tracks. */
  tracks?: string[];
  /** Number of performers, by default one. */
  performers?: number;
  tags?: string[];
  /** Names of the performers' motions, if there are several. */
  pieces?: string[];
  /** For a recording of a session: description of its origin, and id of the motion that was performed. */
  source?: string;
  kept_from?: string;
  [key: string]: unknown;
}

/** Session; `position` and `duration` in microseconds, `limbs` the id or null of the holder of each limb. */
export interface Session {
  id: string;
  motion: string;
  /** Motion of the library that `motion` is made of: another one with live performers; null if they are alone. */
  base: string | null;
  playing: boolean;
  loop: boolean;
  position: number;
  duration: number;
  epoch: number;
  viewers: number;
  puppeteers: { id: string; name: string; colour: number }[];
  limbs: (string | null)[];
  /** Limbs that are open to the crowd. */
  crowd?: CrowdPresence[];
  /** Props. */
  props?: PropPresence[];
}

/** Edit of a session's timeline, its open limbs and its props; `position` in microseconds. */
export interface SessionEdit {
  playing?: boolean;
  position?: number;
  loop?: boolean;
  motion?: string;
  /** Policy of each limb to open to the crowd, by name or number of the limb; null closes it. */
  crowd?: Readonly<Record<string, "median" | "trimmed mean" | "turns" | "vote" | null>>;
  /**
   * Kind of each prop to bring on the stage, by number (0 to 7): "fan", "umbrella", "ball", "branch" or the id of a
   * stored prop; null removes it.
   */
  props?: Readonly<Record<string, string | null>>;
}

/**
 * Camera position at one time: `time` of the reference clock in microseconds, `position` and point of `gaze` in metres
 * in the motion's frame, and the vertical field of view in radians.
 */
export interface CameraKeyframe {
  time: number;
  position: [number, number, number];
  gaze: [number, number, number];
  fov: number;
}

/** Request to record a session: the last `seconds`, or as much as possible, with camera keyframes if any. */
export interface Recording {
  name?: string;
  seconds?: number;
  camera?: readonly CameraKeyframe[];
}

/** One page of a list, and the cursor of the next page. */
export interface Page<T> {
  items: T[];
  next: string | null;
}

/** Condition on listed motions; an empty text is none. Case is ignored. */
export interface MotionQuery {
  /** Every word of it occurs in the name. */
  readonly search: string;
  /** One of the tags. */
  readonly tag: string;
}

/** List motions, newest first, all or those of a query. */
export function listMotions(cursor?: string, { search, tag }: Partial<MotionQuery> = {}): Promise<Page<Motion>> {
  return requestJson("GET", `/v1/motions${queryOf({ cursor, search, tag })}`) as Promise<Page<Motion>>;
}

/** Delete a motion. */
export async function deleteMotion(id: string): Promise<void> {
  await requestJson("DELETE", `/v1/motions/${encodeURIComponent(id)}`);
}

/** Create a motion from `motion` and the performers of `motions`, placed in a row; at most four performers. */
export function addPerformers(motion: string, motions: readonly string[], access = pageAccess): Promise<Motion> {
  return requestJson(
    "POST",
    `/v1/motions/${encodeURIComponent(motion)}/performers`,
    { motions },
    access,
  ) as Promise<Motion>;
}

/** Create a session for a motion. */
export function createSession(motion: string): Promise<Session> {
  return requestJson("POST", "/v1/sessions", { motion }) as Promise<Session>;
}

/** List sessions. */
export function listSessions(cursor?: string, access = pageAccess): Promise<Page<Session>> {
  return requestJson("GET", `/v1/sessions${queryOf({ cursor })}`, undefined, access) as Promise<Page<Session>>;
}

/** Get a session. */
export function getSession(id: string): Promise<Session> {
  return requestJson("GET", `/v1/sessions/${encodeURIComponent(id)}`) as Promise<Session>;
}

/** Play, pause, seek, loop, or change the motion, for all viewers. */
export function editSession(id: string, edit: SessionEdit, access = pageAccess): Promise<Session> {
  return requestJson("PATCH", `/v1/sessions/${encodeURIComponent(id)}`, edit, access) as Promise<Session>;
}

/**
 * Return the first running session. If there is none and `access` allows it, create one that plays the newest motion.
 * Returns null if there is no session and none can be created.
 */
export async function findOrCreateSession(
  newestMotion: Promise<string | null>,
  access = pageAccess,
): Promise<Session | null> {
  const { items } = await listSessions(undefined, access);
  if (items.length > 0) return items[0];
  const motion = access.allows("control") ? await newestMotion : null;
  return motion ? createSession(motion) : null;
}

/** Record a session as a new motion; resolves after some seconds of work, when the motion can be played. */
export function recordSession(session: string, recording: Recording = {}): Promise<Motion> {
  return requestJson("POST", `/v1/sessions/${encodeURIComponent(session)}/recordings`, recording) as Promise<Motion>;
}

/** Lengths of a figure in metres by joint name: each joint from its parent, and the tips from their joints. */
export interface PerformerFigure {
  offsets: Readonly<Record<string, readonly [number, number, number]>>;
  tips: Readonly<Record<string, readonly [number, number, number]>>;
}

/** Request to bring a live performer on a stage. */
export interface NewPerformer {
  name?: string;
  /** Samples per second that will be sent, 10..240; 60 by default. */
  fps?: number;
  /** The standard figure by default. */
  figure?: PerformerFigure;
  /** Id of the session; by default a new one is created. */
  session?: string;
  /** x and z in metres and the turn about y in radians; by default the next free place. */
  place?: readonly [number, number, number];
}

/** Live performer as described by the server. */
export interface LivePerformer {
  id: string;
  name: string;
  fps: number;
  session: string;
  /** Number on the stage. */
  performer: number;
  /** Id of the motion that is in the library when the performance has ended. */
  motion: string;
  /** Path of the socket for samples. */
  input: string;
}

/** Bring a live performer on a stage. */
export function createPerformer(performer: NewPerformer, access = pageAccess): Promise<LivePerformer> {
  return requestJson("POST", "/v1/performers", performer, access) as Promise<LivePerformer>;
}

/** End a performance, also while the page is unloaded. */
export async function endPerformer(id: string, access = pageAccess): Promise<void> {
  const url = `${access.server}/v1/performers/${encodeURIComponent(id)}`;
  await access.request(url, { method: "DELETE", keepalive: true });
}

/** Link for viewers, relative to the page's URL, and the time at which it expires (RFC 3339). */
export interface ShareLink {
  link: string;
  expires: string;
}

/** Share a session. The link lasts for a week, but no longer than the token of a puppeteer. */
export async function shareSession(session: string): Promise<ShareLink> {
  return (await requestJson("POST", "/v1/shares", { session })) as ShareLink;
}

/**
 * Current stage of an upload, on the way or on the server, and the share of the stage that is done, 0..1. If the file
 * has several takes, `take` is the number of the current one, from 1, of `takes`.
 */
export interface UploadProgress {
  stage: "sending" | "preparing" | "waiting" | "reading" | "encoding";
  share: number;
  take?: number;
  takes?: number;
}

/** Take of a file that was not stored, and the reason; `take` is null for those beyond the maximum of a file. */
export interface SkippedTake {
  take: string | null;
  title: string;
  detail: string;
  line: number | null;
  hint: string | null;
}

/** Motions of a file, takes that were not stored, and the names of takes that the server stores later. */
export interface StoredTakes {
  items: Motion[];
  skipped: SkippedTake[];
  pending: string[];
}

/** Interval between requests for the progress of an upload on the server. */
export const PROGRESS_INTERVAL_MS = 400;

/**
 * Upload a motion capture file, and store each of its takes. The progress on the server is polled.
 *
 * @throws ProblemError if the upload fails, or the reason of `signal` if it is aborted
 */
export async function uploadTakes(
  file: File,
  onProgress?: (progress: UploadProgress) => void,
  signal?: AbortSignal,
): Promise<StoredTakes> {
  const uploadId = createUploadId();
  const ended = new AbortController();
  const path = `/v1/motions?filename=${encodeURIComponent(file.name)}&upload=${uploadId}&takes=all`;
  try {
    const stored = await sendFile(path, file, {
      signal,
      onProgress: (share) => onProgress?.({ stage: "sending", share }),
      onSent: () => void (onProgress && pollProgress(uploadId, onProgress, ended.signal)),
    });
    return translateReasons(stored as StoredTakes);
  } finally {
    ended.abort();
  }
}

/** Translate the server's reasons for takes that were not stored. */
function translateReasons({ skipped, ...stored }: StoredTakes): StoredTakes {
  const { translateServerText } = pageTranslator;
  return {
    ...stored,
    skipped: skipped.map(({ take, title, detail, line, hint }) => ({
      take,
      title: translateServerText(title),
      detail: translateServerText(detail),
      line,
      hint: hint && translateServerText(hint),
    })),
  };
}

/** Report the progress of an upload on the server until `ended`. Errors are ignored: the upload reports its own. */
export async function pollProgress(
  uploadId: string,
  onProgress: (progress: UploadProgress) => void,
  ended: AbortSignal,
): Promise<void> {
  while (!ended.aborted) {
    const progress = (await requestJson("GET", `/v1/uploads/${uploadId}`).catch(() => null)) as
      | UploadProgress
      | { stage: "receiving" }
      | null;
    if (ended.aborted) return;
    if (progress && progress.stage !== "receiving") onProgress(progress);
    await new Promise((resolve) => setTimeout(resolve, PROGRESS_INTERVAL_MS));
  }
}

/** Return 32 random hexadecimal digits. `crypto.randomUUID` does not exist on pages without TLS. */
export function createUploadId(): string {
  return Array.from(crypto.getRandomValues(new Uint8Array(16)), (byte) => byte.toString(16).padStart(2, "0")).join("");
}

/** Return the query of a URL with these parameters, without the empty ones. */
export function queryOf(parameters: Record<string, string | undefined>): string {
  const pairs = Object.entries(parameters).flatMap(([name, value]) =>
    value ? `${name}=${encodeURIComponent(value)}` : [],
  );
  return pairs.length > 0 ? `?${pairs.join("&")}` : "";
}

/** Send a request with a JSON body, if any, and return the JSON of the response. Rejects with ProblemError. */
export async function requestJson(
  method: string,
  path: string,
  body?: unknown,
  access: Access = pageAccess,
  signal?: AbortSignal,
): Promise<unknown> {
  const content =
    body === undefined ? {} : { headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) };
  const options = { method, ...content, ...(signal ? { signal } : {}) };
  const text = await (await access.request(access.server + path, options)).text();
  return text === "" ? null : JSON.parse(text);
}
