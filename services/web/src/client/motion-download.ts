/**
 * Download of one performer's motion, and of its extension, at the highest bitrate level over HTTP, except for blocks
 * that a viewer holds.
 */

import { DamagedBlock } from "../codec/errors";
import { PROP_PART, PropTrack } from "../codec/extension/props";
import { type ExtensionPart, ExtensionTrack } from "../codec/extension/track";
import { MotionTrack } from "../codec/motion-track";
import { parseLadder, parseTiming, type Timing } from "../codec/timing";
import { MotionBlockStore, type TrackBlockStore } from "../playout/block-store";
import { ExtensionBlockStore } from "../playout/extension-values";
import { PropBlockStore } from "../playout/prop-store";
import { unpackServerMessage } from "../wire/client-codec";
import { MalformedMessage } from "../wire/errors";
import type { Message, Track } from "../wire/messages";
import { pageAccess } from "./access";
import { ProblemError } from "./problem";

const MAX_CONCURRENT_REQUESTS = 4;

export interface MotionDownloadOptions {
  /** Number of the performer. */
  performer?: number;
  /** Blocks that are already there, if any. */
  existing?: MotionBlockStore | null;
  /** Listener for the share of the blocks that is there, 0..1. */
  onProgress?: (share: number) => void;
  signal?: AbortSignal;
}

/** A downloaded motion, the number of frames to use, and the extensions that there are and that can be read. */
export interface DownloadedMotion {
  store: MotionBlockStore;
  frames: number;
  extensions: Partial<Record<ExtensionPart, ExtensionBlockStore>>;
}

/** Blocks of a track that are to be fetched. */
interface MissingBlocks {
  track: number;
  store: TrackBlockStore<Timing, { readonly frames: number }>;
  level: number;
  indices: number[];
}

/**
 * Download a performer's blocks at the highest level. A motion is as long as the track of its first performer, so a
 * longer track is cut.
 *
 * @throws ProblemError if the download fails, or the reason of `signal` if it is aborted
 */
export async function downloadMotion(
  motion: string,
  { performer = 0, existing = null, onProgress, signal }: MotionDownloadOptions = {},
): Promise<DownloadedMotion> {
  const base = `/v1/motions/${encodeURIComponent(motion)}`;
  try {
    const { tracks } = await fetchMessage(`${base}/description`, "Description", signal);
    const motionTracks = [...tracks.keys()].filter((index) => tracks[index].type === "motion");
    const trackIndex = motionTracks.at(performer);
    if (trackIndex === undefined)
      throw new DamagedBlock(`The motion has no performer ${performer}, only ${motionTracks.length}.`);
    const track = MotionTrack.fromDescription(tracks[trackIndex]);
    const store = new MotionBlockStore(track);
    if (existing) store.mergeFrom(existing);
    const { durationUs } = parseTiming(tracks[motionTracks[0]], "motion");
    const frames = Math.min(track.frames, Math.max(1, Math.round((durationUs * track.fps) / 1e6)));
    const isUsed = (index: number) => track.firstFrame(index) < frames;
    const missing = [missingBlocks(trackIndex, store, track.ladder.length - 1, isUsed)];
    const extensions: DownloadedMotion["extensions"] = {};
    for (const { index, store: extension, highest } of findExtensions(tracks, performer)) {
      extensions[extension.track.content.part] ??= extension;
      missing.push(missingBlocks(index, extension, highest, isUsed));
    }
    await fetchBlocks(base, missing, { onProgress, signal });
    return { store, frames, extensions };
  } catch (error) {
    throw toProblem(error, signal);
  }
}

/**
 * Download the props of a motion, of those tracks that can be read.
 *
 * @throws ProblemError if the download fails, or the reason of `signal` if it is aborted
 */
export async function downloadProps(motion: string, signal?: AbortSignal): Promise<PropBlockStore[]> {
  const base = `/v1/motions/${encodeURIComponent(motion)}`;
  try {
    const { tracks } = await fetchMessage(`${base}/description`, "Description", signal);
    const found = tracks.flatMap((track, index) => {
      const opened = track.type === "extension" && track["part"] === PROP_PART ? openProps(track) : null;
      return opened ? [{ index, store: opened }] : [];
    });
    const missing = found.map(({ index, store }) => missingBlocks(index, store, 0, () => true));
    await fetchBlocks(base, missing, { signal });
    return found.map(({ store }) => store);
  } catch (error) {
    throw toProblem(error, signal);
  }
}

/** Fetch missing blocks, several at a time, into their stores. */
async function fetchBlocks(
  base: string,
  missing: readonly MissingBlocks[],
  { onProgress, signal }: { onProgress?: MotionDownloadOptions["onProgress"]; signal: AbortSignal | undefined },
): Promise<void> {
  const requests = missing.flatMap((each) => each.indices.map((index) => ({ ...each, index })));
  const total = Math.max(requests.length, 1);
  let doneCount = 0;
  const fetchMissing = async () => {
    for (let request = requests.shift(); request !== undefined; request = requests.shift()) {
      const { track: number, level, index } = request;
      const { block } = await fetchMessage(`${base}/blocks/${level}/${index}?track=${number}`, "Data", signal);
      request.store.put(index, level, block);
      signal?.throwIfAborted();
      onProgress?.(++doneCount / total);
    }
  };
  await Promise.all(Array.from({ length: MAX_CONCURRENT_REQUESTS }, fetchMissing));
}

/** Return the error to throw; throw the reason of `signal` if it is aborted. */
function toProblem(error: unknown, signal: AbortSignal | undefined): unknown {
  signal?.throwIfAborted();
  return error instanceof DamagedBlock || error instanceof MalformedMessage
    ? new ProblemError(0, "This motion cannot be read", error.message)
    : error;
}

/** Return a store for a track of props, null if the track cannot be read. */
function openProps(track: Track): PropBlockStore | null {
  try {
    return new PropBlockStore(PropTrack.fromDescription(track));
  } catch (error) {
    if (!(error instanceof DamagedBlock)) throw error;
    return null;
  }
}

/** Return the blocks of a store that are used and not there at this level. */
function missingBlocks(
  track: number,
  store: MissingBlocks["store"],
  level: number,
  isUsed: (index: number) => boolean,
): MissingBlocks {
  const indices = [...store.levels.keys()].filter((index) => isUsed(index) && store.levels[index] < level);
  return { track, store, level, indices };
}

/** Return the extensions of a performer that can be read, with the index of their tracks and their highest levels. */
function findExtensions(
  tracks: readonly Track[],
  performer: number,
): { index: number; store: ExtensionBlockStore; highest: number }[] {
  return tracks.flatMap((track, index) => {
    if (track.type !== "extension" || track.performer !== performer) return [];
    try {
      const store = new ExtensionBlockStore(ExtensionTrack.fromDescription(track));
      return [{ index, store, highest: parseLadder(track, "extension").length - 1 }];
    } catch (error) {
      if (!(error instanceof DamagedBlock)) throw error;
      return [];
    }
  });
}

/** Fetch the message at `url`; raise `MalformedMessage` if it has another name. */
async function fetchMessage<Name extends Message["name"]>(
  url: string,
  name: Name,
  signal?: AbortSignal,
): Promise<Extract<Message, { name: Name }>> {
  const response = await pageAccess.request(url, signal ? { signal } : {});
  const message = unpackServerMessage(new Uint8Array(await response.arrayBuffer()));
  if (message?.name !== name)
    throw new MalformedMessage(
      `Response of ${url} is a message ${message?.name ?? "of unknown type"}, expected ${name}.`,
    );
  return message as Extract<Message, { name: Name }>;
}
