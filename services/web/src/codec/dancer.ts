/**
 * A dancer in few bytes: limb lengths, and the pose that rotations are told from (`proto/SPEC.md`, Dancer).
 *
 * Whole numbers, each as Exp-Golomb with models that learn; a limb of the right side is told by how its numbers' sizes differ
 * from the left's, mostly not at all, and by whose signs do.
 */

import { fromRotationVector } from "../motion/rotation";
import { type Figure, JOINT_COUNT, JOINTS, TIPS } from "../motion/skeleton";
import { DamagedBlock } from "./errors";
import { EVEN, RangeDecoder } from "./rangecoder";

/** Metres in one unit of a figure's numbers at grid 0; every grid is twice as coarse as the one before. */
const FINEST_GRID = 1e-4;
const MOST_GRID = 7;
/** Bits after the point of a reference in radians, at most. */
const MOST_BITS = 14;
const LARGEST_DANCER = 1024;

/** Bits of a number, less one, are fewer. */
const NUMBER_BITS = 17;
/** Odds of another bit before any number is seen, 0.7. */
const LONGER = 22938;

const ROWS = JOINT_COUNT + TIPS.length;
const NAMES = [...JOINTS, ...TIPS.map((joint) => `${JOINTS[joint]} tip`)];
const TWIN = NAMES.map((name) => (name.startsWith("r_") ? NAMES.indexOf(`l${name.slice(1)}`) : -1));
/** Rows of lengths, then of references: of each the one before that it mirrors, or -1. */
const TWIN_ROWS = [...TWIN, ...TWIN.slice(0, JOINT_COUNT).map((twin) => (twin < 0 ? -1 : ROWS + twin))];
/** Models of each number: lengths on the three axes and what they differ from the twin's (0-3), and references (4-7). */
const GROUPS = TWIN_ROWS.flatMap((twin, row) => [0, 1, 2].map((axis) => (twin < 0 ? axis : 3) + (row < ROWS ? 0 : 4)));
/** Of each number the one before that it mirrors, or -1. */
const TWINS = TWIN_ROWS.flatMap((twin) => [0, 1, 2].map((axis) => (twin < 0 ? -1 : 3 * twin + axis)));

export interface Dancer {
  figure: Figure;
  /** Each joint's typical rotation (72, w x y z), which its channel is relative to; the root's as the dancer's left points along x. */
  reference: Float64Array;
}

/** @throws DamagedBlock */
export function unpackDancer(data: Uint8Array): Dancer {
  if (data.length < 1 || data.length > LARGEST_DANCER) {
    throw new DamagedBlock(`a dancer has 1..${LARGEST_DANCER} bytes, not ${data.length}`);
  }
  const grid = data[0] >> 4, bits = data[0] & 15;
  if (grid > MOST_GRID || bits > MOST_BITS) {
    throw new DamagedBlock(
      `a dancer's grid is ${grid} and its reference in 2^-${bits} radians; ${MOST_GRID} and 2^-${MOST_BITS} are the most`,
    );
  }
  const numbers = decodeNumbers(data.subarray(1));
  const metres = FINEST_GRID * 2 ** grid;
  const figure = { offsets: new Float64Array(JOINT_COUNT * 3), tips: new Float64Array(JOINT_COUNT * 3) };
  for (let i = 0; i < JOINT_COUNT * 3; i++) figure.offsets[i] = numbers[i] * metres;
  TIPS.forEach((joint, tip) => {
    for (let axis = 0; axis < 3; axis++) figure.tips[joint * 3 + axis] = numbers[(JOINT_COUNT + tip) * 3 + axis] * metres;
  });
  const reference = new Float64Array(JOINT_COUNT * 4);
  for (let joint = 0; joint < JOINT_COUNT; joint++) {
    const [x, y, z] = numbers.subarray((ROWS + joint) * 3).map((number) => number * 2 ** -bits);
    fromRotationVector(reference, joint * 4, x, y, z);
  }
  return { figure, reference };
}

/**
 * Each number by the models of its group, which learn: of a number its size plus one, its bits less one in unary, then its low
 * bits, then the sign; of one with a twin before it what its size differs from the twin's, in the same way, and whether its
 * sign does.
 */
function decodeNumbers(data: Uint8Array): Float64Array {
  const decoder = new RangeDecoder(data);
  const groups = Math.max(...GROUPS) + 1;
  const lengths = new Int32Array(groups * NUMBER_BITS).fill(LONGER), signs = new Int32Array(groups).fill(EVEN);
  const learned = (model: Int32Array, at: number): 0 | 1 => {
    const bit = decoder.bit(model[at]);
    model[at] = Math.min(Math.max(model[at] + (((bit ? 32768 : 0) - model[at]) >> 3), 1024), 31744);
    return bit;
  };
  const values = new Float64Array(GROUPS.length);
  GROUPS.forEach((group, i) => {
    let length = 0;
    while (length < NUMBER_BITS && learned(lengths, group * NUMBER_BITS + length)) length++;
    if (length === NUMBER_BITS) throw new DamagedBlock(`a number is longer than ${NUMBER_BITS} bits`);
    let size = ((1 << length) | decoder.number(length)) - 1;
    let negative = size > 0 && decoder.bit(EVEN) === 1;
    if (TWINS[i] >= 0) {
      const twin = values[TWINS[i]];
      size = Math.abs(twin) + (negative ? -size : size);
      if (size < 0) throw new DamagedBlock("a number's size is less than none");
      negative = size > 0 && (learned(signs, group) === 1) !== twin < 0;
    }
    values[i] = negative ? -size : size;
  });
  return values;
}
