/** Decoder of motion blocks: bytes to poses at any instant (`proto/codec.md`, 2.8 and 2.9). */

import { fromRotationVector, multiply } from "../motion/rotation";
import { CHANNEL_COUNT, JOINT_COUNT, type Pose } from "../motion/skeleton";
import { decodeCoefficients } from "./coefficients";
import type { MotionTrack } from "./motion-track";
import { loadShippedPrior, type Prior } from "./prior";
import { MAX_BLOCK_FRAMES } from "./timing";
import { cosineBasis } from "./transform";

/** Quantiser step of index 0 for a block of 30 frames, metres. It doubles every 16 indices. */
const BASE_STEP_M = 2 ** -16;

const cosines = new Float64Array(MAX_BLOCK_FRAMES);
const rotationVectors = new Float64Array(JOINT_COUNT * 3);

/** A decoded block. */
export class MotionBlock {
  /**
   * @param frames frames of the block
   * @param count frequencies of each axis
   * @param values coefficients [channel 19][axis 3][count], metres, then radians
   * @param reference rotations (72) that the rotation vectors are relative to
   */
  constructor(
    readonly frames: number,
    readonly count: number,
    readonly values: Float64Array,
    readonly reference: Float64Array,
  ) {}

  /** Writes the pose at `t`, in frames from the block's first, any real in [-1/2, frames - 1/2], into `out`. */
  poseAt(t: number, out: Pose): void {
    const { count, values, reference } = this;
    cosineBasis(cosines, this.frames, count, t);
    for (let track = 0, at = 0; track < CHANNEL_COUNT * 3; track++) {
      let sum = 0;
      for (let k = 0; k < count; k++) sum += values[at++] * cosines[k];
      if (track < 3) out.root[track] = sum;
      else rotationVectors[track - 3] = sum;
    }
    const v = rotationVectors;
    for (let joint = 0; joint < JOINT_COUNT; joint++) {
      fromRotationVector(out.rotations, joint * 4, v[joint * 3], v[joint * 3 + 1], v[joint * 3 + 2]);
      multiply(out.rotations, joint * 4, reference, joint * 4, out.rotations, joint * 4);
    }
  }
}

/** Returns the quantiser step at a step index for a block of `frames` frames, metres. */
export function stepSize(index: number, frames: number): number {
  return BASE_STEP_M * 2 ** (index / 16) * Math.sqrt(frames / 30);
}

/**
 * Returns the value of a quantised coefficient in steps, a little below the middle: smaller values are more frequent.
 */
export function reconstruct(q: number): number {
  if (q === 0) return 0;
  const bias = q === 1 || q === -1 ? 0.06 : 0.03;
  return q > 0 ? q - bias : q + bias;
}

/** What the decoder of a block needs of its track. */
export type BlockTrack = Pick<MotionTrack, "fps" | "blockFrames" | "weights" | "referenceRotations">;

/**
 * Decodes one block of `track`. `prior` must be the one with which the block was encoded.
 *
 * @throws DamagedBlock
 */
export function decodeMotionBlock(track: BlockTrack, data: Uint8Array, prior: Prior = loadShippedPrior()): MotionBlock {
  const { frames, step, heading, count, q } = decodeCoefficients(prior, data, track.blockFrames, track.fps);
  const size = stepSize(step, frames);
  const { inverseWeights } = track.weights;
  // in place: the three axes of a frequency are read before they are written
  for (let channel = 0; channel < CHANNEL_COUNT; channel++) {
    const w = channel * 9;
    for (let k = 0; k < count; k++) {
      const at = channel * 3 * count + k;
      const x = reconstruct(q[at]) * size;
      const y = reconstruct(q[at + count]) * size;
      const z = reconstruct(q[at + 2 * count]) * size;
      q[at] = inverseWeights[w] * x + inverseWeights[w + 1] * y + inverseWeights[w + 2] * z;
      q[at + count] = inverseWeights[w + 3] * x + inverseWeights[w + 4] * y + inverseWeights[w + 5] * z;
      q[at + 2 * count] = inverseWeights[w + 6] * x + inverseWeights[w + 7] * y + inverseWeights[w + 8] * z;
    }
  }
  return new MotionBlock(frames, count, q, track.referenceRotations(heading));
}
