/** Blocks of a few frames for the poses of live performers (`proto/codec.md`, 2.16). */

import { DamagedBlock } from "./errors";
import { type BlockTrack, decodeMotionBlock, type MotionBlock } from "./motion-decoder";
import type { MotionTrack } from "./motion-track";

/** Frame rate of live poses, that of overlays. */
export const LIVE_FPS = 60;

/** Skeleton of a live performer, as blocks of any number of frames need it. */
export class LiveTrack implements BlockTrack {
  readonly fps = LIVE_FPS;
  /** Frames of the block that is decoded. */
  blockFrames = 1;
  readonly weights: MotionTrack["weights"];

  /** @param track motion track of the performer, whose skeleton description its live blocks share */
  constructor(private readonly track: MotionTrack) {
    this.weights = track.weights;
  }

  /** Returns the reference rotations of the performer's skeleton description (72). */
  referenceRotations(heading: number): Float64Array {
    return this.track.referenceRotations(heading);
  }

  /**
   * Decodes a block of `frames` frames.
   *
   * @throws DamagedBlock
   */
  decode(frames: number, block: Uint8Array): MotionBlock {
    this.blockFrames = frames;
    const decoded = decodeMotionBlock(this, block);
    if (decoded.frames !== frames)
      throw new DamagedBlock(`A live block has ${decoded.frames} frames, its message ${frames}.`);
    return decoded;
  }
}
