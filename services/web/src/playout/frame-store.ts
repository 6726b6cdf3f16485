/** Blocks of tracks whose values are those of a frame, and are not interpolated (`proto/codec.md`, 2.20 and 2.21). */

import type { Timing } from "../codec/timing";
import { TrackBlockStore } from "./block-store";

/** Decoded blocks of one track of frames. */
export abstract class FrameBlockStore<
  Track extends Timing,
  Block extends { readonly frames: number },
> extends TrackBlockStore<Track, Block> {
  /** Return the block at motion time `position`, and the frame in it that began last; null if it is missing. */
  protected findFrame(position: number): { block: Block; frame: number } | null {
    const { track } = this;
    const location = this.findBlock(position, false, track.durationUs);
    if (!location) return null;
    const { block } = location;
    const frame = Math.floor(((position + 1) * track.fps) / 1e6) - track.firstFrame(track.blockAt(position));
    return { block, frame: Math.min(Math.max(frame, 0), block.frames - 1) };
  }
}
