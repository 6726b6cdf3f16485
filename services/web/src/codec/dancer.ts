/** A dancer in few bytes: limb lengths, and the pose that rotations are told from (`proto/SPEC.md`, Dancer). */

import { fromRotationVector } from "../motion/rotation";
import { type Figure, JOINT_COUNT, JOINTS, TIPS } from "../motion/skeleton";
import { DamagedBlock } from "./errors";
import { EVEN, RangeDecoder } from "./rangecoder";

/** Metres in one unit of a figure's numbers. */
export const FIGURE_UNIT = 1e-4;

const MOST_BITS = 14;
const LARGEST_DANCER = 1024;
const NUMBER_BITS = 17;

const ROWS = JOINT_COUNT + TIPS.length;
const NAMES = [...JOINTS, ...TIPS.map((joint) => `${JOINTS[joint]} tip`)];
/** The row of the left side that a row of the right side is told by; -1 for the others. */
const TWINS = NAMES.map((name) => (name.startsWith("r_") ? NAMES.indexOf(`l${name.slice(1)}`) : -1));
const LENGTHS = 3 * ROWS;
/** Models of: lengths on each axis, differences from the twin, references. */
const GROUPS = [...TWINS.flatMap((twin) => (twin < 0 ? [0, 1, 2] : [3, 3, 3])), ...new Array<number>(3 * (JOINT_COUNT - 1)).fill(4)];

export interface Dancer {
  figure: Figure;
  /** The rotations (72, w x y z; the root's the identity) that each joint's channel is relative to. */
  reference: Float64Array;
}

/** @throws DamagedBlock */
export function unpackDancer(data: Uint8Array): Dancer {
  if (data.length < 1 || data.length > LARGEST_DANCER) {
    throw new DamagedBlock(`a dancer has 1..${LARGEST_DANCER} bytes, not ${data.length}`);
  }
  const bits = data[0];
  if (bits > MOST_BITS) throw new DamagedBlock(`a dancer's reference is in 2^-${bits} radians; 2^-${MOST_BITS} is the finest`);
  const numbers = decodeNumbers(data.subarray(1));
  TWINS.forEach((twin, row) => {
    if (twin < 0) return;
    for (let axis = 0; axis < 3; axis++) numbers[3 * row + axis] += (axis === 0 ? -1 : 1) * numbers[3 * twin + axis];
  });
  const figure = { offsets: new Float64Array(JOINT_COUNT * 3), tips: new Float64Array(JOINT_COUNT * 3) };
  for (let i = 0; i < JOINT_COUNT * 3; i++) figure.offsets[i] = numbers[i] * FIGURE_UNIT;
  TIPS.forEach((joint, tip) => {
    for (let axis = 0; axis < 3; axis++) figure.tips[joint * 3 + axis] = numbers[(JOINT_COUNT + tip) * 3 + axis] * FIGURE_UNIT;
  });
  const reference = new Float64Array(JOINT_COUNT * 4);
  reference[0] = 1;
  for (let joint = 1; joint < JOINT_COUNT; joint++) {
    const at = LENGTHS + (joint - 1) * 3;
    const [x, y, z] = [0, 1, 2].map((axis) => numbers[at + axis] * 2 ** -bits);
    fromRotationVector(reference, joint * 4, x, y, z);
  }
  return { figure, reference };
}

/** Each number's bits less one in unary by the models of its group, which learn; low bits and sign equiprobable. */
function decodeNumbers(data: Uint8Array): Int32Array {
  const decoder = new RangeDecoder(data);
  const models = new Int32Array(5 * NUMBER_BITS).fill(EVEN);
  return Int32Array.from(GROUPS, (group) => {
    let length = 0;
    for (; length < NUMBER_BITS; length++) {
      const at = group * NUMBER_BITS + length;
      const more = decoder.bit(models[at]);
      models[at] = Math.min(Math.max(models[at] + (((more ? 32768 : 0) - models[at]) >> 3), 1024), 31744);
      if (!more) break;
    }
    if (length === NUMBER_BITS) throw new DamagedBlock(`a number is longer than ${NUMBER_BITS} bits`);
    const size = ((1 << length) | decoder.number(length)) - 1;
    return size > 0 && decoder.bit(EVEN) ? -size : size;
  });
}
