/** Download of one performer's motion at the highest bitrate level over HTTP, except for blocks that a viewer holds. */

import { DamagedBlock } from "../codec/errors";
import { MotionTrack } from "../codec/motion-track";
import { parseTiming } from "../codec/timing";
import { MotionBlockStore } from "../playout/block-store";
import { unpackServerMessage } from "../wire/client-codec";
import { MalformedMessage } from "../wire/errors";
import type { Message } from "../wire/messages";
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

/**
 * Download a performer's blocks at the highest level. Return the store and the number of frames to use: a motion is as
 * long as the track of its first performer, so a longer track is cut.
 *
 * @throws ProblemError if the download fails, or the reason of `signal` if it is aborted
 */
export async function downloadMotion(
  motion: string,
  { performer = 0, existing = null, onProgress, signal }: MotionDownloadOptions = {},
): Promise<{ store: MotionBlockStore; frames: number }> {
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
    const highest = track.ladder.length - 1;
    const required = [...store.levels.keys()].filter((index) => track.firstFrame(index) < frames);
    const missing = required.filter((index) => store.levels[index] < highest);
    let doneCount = required.length - missing.length;
    const fetchMissing = async () => {
      for (let index = missing.shift(); index !== undefined; index = missing.shift()) {
        const { block } = await fetchMessage(`${base}/blocks/${highest}/${index}?track=${trackIndex}`, "Data", signal);
        store.put(index, highest, block);
        signal?.throwIfAborted();
        onProgress?.(++doneCount / required.length);
      }
    };
    await Promise.all(Array.from({ length: MAX_CONCURRENT_REQUESTS }, fetchMissing));
    return { store, frames };
  } catch (error) {
    signal?.throwIfAborted();
    if (error instanceof DamagedBlock || error instanceof MalformedMessage)
      throw new ProblemError(0, "This motion cannot be read", error.message);
    throw error;
  }
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
