/** A motion block to the pose at any instant (`proto/SPEC.md`, Motion block, format 1). */

import { fromRotationVector, multiply } from "../motion/rotation";
import { CHANNEL_COUNT, JOINT_COUNT, type Pose } from "../motion/skeleton";
import { decodeCoefficients } from "./coefficients";
import { DamagedBlock } from "./errors";
import { MOST_FRAMES, type MotionTrack, REFERENCE_UNIT } from "./track";
import { basis } from "./transform";

const FORMAT = 1;
const HEADER = 7;
const LARGEST_BLOCK = 65_536;

const cosines = new Float64Array(MOST_FRAMES);
const rotationVectors = new Float64Array(JOINT_COUNT * 3);

/** A decoded block. Coefficients stay integers: they take half the memory, and are scaled once per channel when drawn. */
export class MotionBlock {
  /**
   * @param frames frames of the block
   * @param count frequencies of each track
   * @param q quantised coefficients [channel 19][axis 3][count]
   * @param steps quantiser step of each channel (19): metres, then radians
   * @param reference rotations (72) that the rotation vectors are relative to
   */
  constructor(
    readonly frames: number,
    readonly count: number,
    readonly q: Int32Array,
    readonly steps: Float64Array,
    readonly reference: Float64Array,
  ) {}

  /** The pose at `t`, in frames from the block's first, any real in [-1/2, frames - 1/2], written into `out`. */
  at(t: number, out: Pose): void {
    const { count, q, steps, reference } = this;
    basis(cosines, this.frames, count, t);
    for (let track = 0, at = 0; track < CHANNEL_COUNT * 3; track++) {
      let sum = 0;
      for (let k = 0; k < count; k++) sum += q[at++] * cosines[k];
      const value = sum * steps[(track / 3) | 0];
      if (track < 3) out.root[track] = value;
      else rotationVectors[track - 3] = value;
    }
    const v = rotationVectors;
    for (let joint = 0; joint < JOINT_COUNT; joint++) {
      fromRotationVector(out.rotations, joint * 4, v[joint * 3], v[joint * 3 + 1], v[joint * 3 + 2]);
      multiply(out.rotations, joint * 4, reference, joint * 4, out.rotations, joint * 4);
    }
  }
}

/**
 * Decodes one block of `track`.
 *
 * @throws DamagedBlock on anything that is not one
 */
export function decodeBlock(track: MotionTrack, data: Uint8Array): MotionBlock {
  if (data.length < HEADER || data.length > LARGEST_BLOCK) {
    throw new DamagedBlock(`a block has ${HEADER}..${LARGEST_BLOCK} bytes, not ${data.length}`);
  }
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  const format = view.getUint8(0);
  if (format !== FORMAT) throw new DamagedBlock(`block is of format ${format}; this decoder reads ${FORMAT}`);
  const frames = view.getUint16(2, true);
  if (frames < 1 || frames > MOST_FRAMES) {
    throw new DamagedBlock(`block says ${frames} frames; 1..${MOST_FRAMES} are allowed`);
  }
  const { count, q } = decodeCoefficients(data, HEADER, frames);
  const step = 1e-4 * 2 ** (view.getUint8(1) / 4) * Math.sqrt(frames / 30);
  const reference = track.reference.slice();
  const [x, y, z] = [4, 5, 6].map((byte) => view.getInt8(byte) * REFERENCE_UNIT);
  fromRotationVector(reference, 0, x, y, z);
  return new MotionBlock(frames, count, q, track.levers.map((lever) => step / lever), reference);
}
