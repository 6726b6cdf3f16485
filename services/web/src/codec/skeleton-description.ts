/**
 * A dancer in few bytes: limb lengths, and the pose that rotations are told from (`proto/SPEC.md`, Dancer).
 *
 * Whole numbers, each as Exp-Golomb with models that learn; a limb of the right side is told by how its numbers' sizes differ
 * from the left's, mostly not at all, and by whose signs do.
 */

import { fromRotationVector } from "../motion/rotation";
import { type Figure, JOINT_COUNT, JOINTS, TIP_JOINTS } from "../motion/skeleton";
import { DamagedBlock } from "./errors";
import { HALF_PROBABILITY, RangeDecoder } from "./range-coder";

/** Metres in one unit of a figure's numbers at grid 0; every grid is twice as coarse as the one before. */
const FINEST_GRID_M = 1e-4;
const MAX_GRID = 7;
/** Bits after the point of a reference in radians, at most. */
const MAX_REFERENCE_BITS = 14;
const MAX_SKELETON_BYTES = 1024;

/** Bits of a number, less one, are fewer. */
const INTEGER_BITS_LIMIT = 17;
/** Odds of another bit before any number is seen, 0.7. */
const INITIAL_LENGTH_PROBABILITY = 22938;

const LENGTH_ROWS = JOINT_COUNT + TIP_JOINTS.length;
const NAMES = [...JOINTS, ...TIP_JOINTS.map((joint) => `${JOINTS[joint]} tip`)];
const MIRROR_ROW = NAMES.map((name) => (name.startsWith("r_") ? NAMES.indexOf(`l${name.slice(1)}`) : -1));
/** Rows of lengths, then of references: of each the one before that it mirrors, or -1. */
const MIRROR_ROWS = [
  ...MIRROR_ROW,
  ...MIRROR_ROW.slice(0, JOINT_COUNT).map((twin) => (twin < 0 ? -1 : LENGTH_ROWS + twin)),
];
/** Models of each number: lengths on the three axes and what they differ from the twin's (0-3), and references (4-7). */
const MODEL_GROUPS = MIRROR_ROWS.flatMap((twin, row) =>
  [0, 1, 2].map((axis) => (twin < 0 ? axis : 3) + (row < LENGTH_ROWS ? 0 : 4)),
);
/** Of each number the one before that it mirrors, or -1. */
const MIRROR_OF = MIRROR_ROWS.flatMap((twin) => [0, 1, 2].map((axis) => (twin < 0 ? -1 : 3 * twin + axis)));

export interface SkeletonDescription {
  figure: Figure;
  /** Each joint's typical rotation (72, w x y z), which its channel is relative to; the root's as the dancer's left points along x. */
  reference: Float64Array;
}

/** @throws DamagedBlock */
export function unpackSkeletonDescription(data: Uint8Array): SkeletonDescription {
  if (data.length < 1 || data.length > MAX_SKELETON_BYTES) {
    throw new DamagedBlock(`a dancer has 1..${MAX_SKELETON_BYTES} bytes, not ${data.length}`);
  }
  const grid = data[0] >> 4,
    bits = data[0] & 15;
  if (grid > MAX_GRID || bits > MAX_REFERENCE_BITS) {
    throw new DamagedBlock(
      `a dancer's grid is ${grid} and its reference in 2^-${bits} radians; ${MAX_GRID} and 2^-${MAX_REFERENCE_BITS} are the most`,
    );
  }
  const numbers = decodeIntegers(data.subarray(1));
  const metres = FINEST_GRID_M * 2 ** grid;
  const figure = { offsets: new Float64Array(JOINT_COUNT * 3), tips: new Float64Array(JOINT_COUNT * 3) };
  for (let i = 0; i < JOINT_COUNT * 3; i++) figure.offsets[i] = numbers[i] * metres;
  TIP_JOINTS.forEach((joint, tip) => {
    for (let axis = 0; axis < 3; axis++)
      figure.tips[joint * 3 + axis] = numbers[(JOINT_COUNT + tip) * 3 + axis] * metres;
  });
  const reference = new Float64Array(JOINT_COUNT * 4);
  for (let joint = 0; joint < JOINT_COUNT; joint++) {
    const [x, y, z] = numbers.subarray((LENGTH_ROWS + joint) * 3).map((number) => number * 2 ** -bits);
    fromRotationVector(reference, joint * 4, x, y, z);
  }
  return { figure, reference };
}

/**
 * Each number by the models of its group, which learn: of a number its size plus one, its bits less one in unary, then its low
 * bits, then the sign; of one with a twin before it what its size differs from the twin's, in the same way, and whether its
 * sign does.
 */
function decodeIntegers(data: Uint8Array): Float64Array {
  const decoder = new RangeDecoder(data);
  const groups = Math.max(...MODEL_GROUPS) + 1;
  const lengths = new Int32Array(groups * INTEGER_BITS_LIMIT).fill(INITIAL_LENGTH_PROBABILITY),
    signs = new Int32Array(groups).fill(HALF_PROBABILITY);
  const learned = (model: Int32Array, at: number): 0 | 1 => {
    const bit = decoder.decodeBit(model[at]);
    model[at] = Math.min(Math.max(model[at] + (((bit ? 32768 : 0) - model[at]) >> 3), 1024), 31744);
    return bit;
  };
  const values = new Float64Array(MODEL_GROUPS.length);
  MODEL_GROUPS.forEach((group, i) => {
    let length = 0;
    while (length < INTEGER_BITS_LIMIT && learned(lengths, group * INTEGER_BITS_LIMIT + length)) length++;
    if (length === INTEGER_BITS_LIMIT) throw new DamagedBlock(`a number is longer than ${INTEGER_BITS_LIMIT} bits`);
    let size = ((1 << length) | decoder.decodeBits(length)) - 1;
    let negative = size > 0 && decoder.decodeBit(HALF_PROBABILITY) === 1;
    if (MIRROR_OF[i] >= 0) {
      const twin = values[MIRROR_OF[i]];
      size = Math.abs(twin) + (negative ? -size : size);
      if (size < 0) throw new DamagedBlock("a number's size is less than none");
      negative = size > 0 && (learned(signs, group) === 1) !== twin < 0;
    }
    values[i] = negative ? -size : size;
  });
  return values;
}
