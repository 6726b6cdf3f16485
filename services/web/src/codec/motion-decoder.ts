/** A motion block to the pose at any instant (`proto/SPEC.md`, Motion block, format 2). */

import { fromRotationVector, multiply } from "../motion/rotation";
import { CHANNEL_COUNT, JOINT_COUNT, type Pose } from "../motion/skeleton";
import { decodeCoefficients, MAX_BLOCK_FRAMES } from "./coefficients";
import type { MotionTrack } from "./motion-track";
import { loadShippedPrior, type Prior } from "./prior";
import { cosineBasis } from "./transform";

/** Quantiser step of index 0 for a block of 30 frames, metres; sixteen indices make it twice as large. */
const BASE_STEP_M = 2 ** -16;

const cosines = new Float64Array(MAX_BLOCK_FRAMES);
const rotationVectors = new Float64Array(JOINT_COUNT * 3);

/** A decoded block. */
export class MotionBlock {
  /**
   * @param frames frames of the block
   * @param count frequencies of each track
   * @param values coefficients [channel 19][axis 3][count], metres, then radians
   * @param reference rotations (72) that the rotation vectors are relative to
   */
  constructor(
    readonly frames: number,
    readonly count: number,
    readonly values: Float64Array,
    readonly reference: Float64Array,
  ) {}

  /** The pose at `t`, in frames from the block's first, any real in [-1/2, frames - 1/2], written into `out`. */
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

/** Quantiser step at step index `index` of the weighted coefficients of a block of `frames` frames, metres. */
export function stepSize(index: number, frames: number): number {
  return BASE_STEP_M * 2 ** (index / 16) * Math.sqrt(frames / 30);
}

/** The value of a quantised coefficient, in steps: a little below the middle, where values are denser. */
export function reconstruct(q: number): number {
  if (q === 0) return 0;
  const less = q === 1 || q === -1 ? 0.06 : 0.03;
  return q > 0 ? q - less : q + less;
}

/**
 * Decodes one block of `track`, with the shipped prior unless another is given: nothing but the prior that it was encoded with
 * decodes a block.
 *
 * @throws DamagedBlock on what cannot be one
 */
export function decodeMotionBlock(
  track: MotionTrack,
  data: Uint8Array,
  prior: Prior = loadShippedPrior(),
): MotionBlock {
  const { frames, step, heading, count, q } = decodeCoefficients(prior, data, track.blockFrames, track.fps);
  const size = stepSize(step, frames);
  const { inverseWeights: inverses } = track.weights;
  // in place: of each frequency the three axes are read before they are written
  for (let channel = 0; channel < CHANNEL_COUNT; channel++) {
    const w = channel * 9;
    for (let k = 0; k < count; k++) {
      const at = channel * 3 * count + k;
      const x = reconstruct(q[at]) * size;
      const y = reconstruct(q[at + count]) * size;
      const z = reconstruct(q[at + 2 * count]) * size;
      q[at] = inverses[w] * x + inverses[w + 1] * y + inverses[w + 2] * z;
      q[at + count] = inverses[w + 3] * x + inverses[w + 4] * y + inverses[w + 5] * z;
      q[at + 2 * count] = inverses[w + 6] * x + inverses[w + 7] * y + inverses[w + 8] * z;
    }
  }
  return new MotionBlock(frames, count, q, track.referenceRotations(heading));
}
