/** The whole dance of one performer of a motion at its best rate, over HTTP, with what a viewer has of it already. */

import { DamagedBlock } from "../codec/errors";
import { MotionTrack } from "../codec/motion-track";
import { parseTiming } from "../codec/timing";
import { MotionBlockStore } from "../playout/block-store";
import { unpack } from "../wire/codec";
import { MalformedMessage } from "../wire/errors";
import type { Message } from "../wire/messages";
import { request } from "./access";
import { ProblemError } from "./problem";

/** Blocks asked for at a time. */
const MAX_CONCURRENT_REQUESTS = 4;

export interface MotionDownloadOptions {
  /** Whose dance, by number. */
  performer?: number;
  /** What is here of it, null for nothing. */
  existing?: MotionBlockStore | null;
  /** Told of the share that is here, 0..1. */
  onProgress?: (share: number) => void;
  signal?: AbortSignal;
}

/**
 * Every block of a dance in `motion` at its best rate, and how many of its frames are danced there: the motion is as long as the
 * first performer's dance, at which a longer one is cut. Rejects with ProblemError; given up by `signal`, with the signal's reason.
 */
export async function downloadMotion(
  motion: string,
  { performer = 0, existing: held = null, onProgress: told, signal }: MotionDownloadOptions = {},
): Promise<{ store: MotionBlockStore; frames: number }> {
  const base = `/v1/motions/${encodeURIComponent(motion)}`;
  try {
    const { tracks } = await fetchMessage(`${base}/description`, "Description", signal);
    const dances = [...tracks.keys()].filter((index) => tracks[index].type === "motion");
    const number = dances.at(performer);
    if (number === undefined) throw new DamagedBlock("there is no motion in it");
    const track = MotionTrack.fromDescription(tracks[number]);
    const store = new MotionBlockStore(track);
    if (held) store.mergeFrom(held);
    const lasting = parseTiming(tracks[dances[0]], "motion").durationUs;
    const frames = Math.min(track.frames, Math.max(1, Math.round((lasting * track.fps) / 1e6)));
    const best = track.ladder.length - 1;
    const danced = [...store.levels.keys()].filter((index) => track.firstFrame(index) < frames);
    const missing = danced.filter((index) => store.levels[index] < best);
    let here = danced.length - missing.length;
    const fetchOn = async () => {
      for (let index = missing.shift(); index !== undefined; index = missing.shift()) {
        const { block } = await fetchMessage(`${base}/blocks/${best}/${index}?track=${number}`, "Data", signal);
        store.put(index, best, block);
        signal?.throwIfAborted();
        told?.(++here / danced.length);
      }
    };
    await Promise.all(Array.from({ length: MAX_CONCURRENT_REQUESTS }, fetchOn));
    return { store, frames };
  } catch (error) {
    signal?.throwIfAborted();
    if (error instanceof DamagedBlock || error instanceof MalformedMessage)
      throw new ProblemError(0, "This dance cannot be read", error.message);
    throw error;
  }
}

/** The message of this name at an address. */
async function fetchMessage<Name extends Message["name"]>(
  address: string,
  name: Name,
  signal?: AbortSignal,
): Promise<Extract<Message, { name: Name }>> {
  const answer = await request(address, signal ? { signal } : {});
  const said = unpack(new Uint8Array(await answer.arrayBuffer()));
  if (said?.name !== name) throw new MalformedMessage(`${address} is no ${name}`);
  return said as Extract<Message, { name: Name }>;
}
