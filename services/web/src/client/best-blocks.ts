/** The whole dance of one performer of a motion at its best rate, over HTTP, with what a viewer has of it already. */

import { DamagedBlock } from "../codec/errors";
import { readTiming } from "../codec/timing";
import { MotionTrack } from "../codec/track";
import { BlockStore } from "../playout/blocks";
import { unpack } from "../wire/codec";
import { MalformedMessage } from "../wire/errors";
import type { Message } from "../wire/messages";
import { request } from "./access";
import { ProblemError } from "./problem";

/** Blocks asked for at a time. */
const AT_ONCE = 4;

export interface Fetching {
  /** Whose dance, by number. */
  performer?: number;
  /** What is here of it, null for nothing. */
  held?: BlockStore | null;
  /** Told of the share that is here, 0..1. */
  told?: (share: number) => void;
  signal?: AbortSignal;
}

/**
 * Every block of a dance in `motion` at its best rate, and how many of its frames are danced there: the motion is as long as the
 * first performer's dance, at which a longer one is cut. Rejects with ProblemError; given up by `signal`, with the signal's reason.
 */
export async function bestBlocks(motion: string, { performer = 0, held = null, told, signal }: Fetching = {}): Promise<{ store: BlockStore; frames: number }> {
  const base = `/v1/motions/${encodeURIComponent(motion)}`;
  try {
    const { tracks } = await message(`${base}/description`, "Description", signal);
    const dances = [...tracks.keys()].filter((index) => tracks[index].type === "motion");
    const number = dances.at(performer);
    if (number === undefined) throw new DamagedBlock("there is no motion in it");
    const track = MotionTrack.fromDescription(tracks[number]);
    const store = new BlockStore(track);
    if (held) store.adopt(held);
    const lasting = readTiming(tracks[dances[0]], "motion").durationUs;
    const frames = Math.min(track.frames, Math.max(1, Math.round((lasting * track.fps) / 1e6)));
    const best = track.rates.length - 1;
    const danced = [...store.rates.keys()].filter((index) => track.firstFrame(index) < frames);
    const missing = danced.filter((index) => store.rates[index] < best);
    let here = danced.length - missing.length;
    const fetchOn = async () => {
      for (let index = missing.shift(); index !== undefined; index = missing.shift()) {
        const { block } = await message(`${base}/blocks/${best}/${index}?track=${number}`, "Data", signal);
        store.put(index, best, block);
        signal?.throwIfAborted();
        told?.(++here / danced.length);
      }
    };
    await Promise.all(Array.from({ length: AT_ONCE }, fetchOn));
    return { store, frames };
  } catch (error) {
    signal?.throwIfAborted();
    if (error instanceof DamagedBlock || error instanceof MalformedMessage) throw new ProblemError(0, "This dance cannot be read", error.message);
    throw error;
  }
}

/** The message of this name at an address. */
async function message<Name extends Message["name"]>(address: string, name: Name, signal?: AbortSignal): Promise<Extract<Message, { name: Name }>> {
  const answer = await request(address, signal ? { signal } : {});
  const said = unpack(new Uint8Array(await answer.arrayBuffer()));
  if (said?.name !== name) throw new MalformedMessage(`${address} is no ${name}`);
  return said as Extract<Message, { name: Name }>;
}
