/**
 * Skeleton description: bone lengths and reference pose in few bytes (`proto/codec.md`, 2.4; wire key `dancer`).
 *
 * A sequence of integers, each an Exp-Golomb code with adaptive models. An integer of the right side is coded as the
 * difference of its magnitude from that of the left side, mostly zero, and whether its sign differs.
 */

import { fromRotationVector } from "../motion/rotation";
import { type Figure, JOINT_COUNT, JOINTS, TIP_JOINTS } from "../motion/skeleton";
import { DamagedBlock } from "./errors";
import { decodeIntegers } from "./integer-coder";

/** Unit of a figure's integers at grid 0, metres. Each grid is twice as coarse as the one before. */
const FINEST_GRID_M = 1e-4;
const MAX_GRID = 7;
/** Limit of the fractional bits of a reference in radians. */
const MAX_REFERENCE_BITS = 14;
const MAX_SKELETON_BYTES = 1024;

const LENGTH_ROWS = JOINT_COUNT + TIP_JOINTS.length;
const NAMES = [...JOINTS, ...TIP_JOINTS.map((joint) => `${JOINTS[joint]} tip`)];
const MIRROR_ROW = NAMES.map((name) => (name.startsWith("r_") ? NAMES.indexOf(`l${name.slice(1)}`) : -1));
/** Earlier row that each row mirrors, or -1: rows of lengths, then of references. */
const MIRROR_ROWS = [
  ...MIRROR_ROW,
  ...MIRROR_ROW.slice(0, JOINT_COUNT).map((row) => (row < 0 ? -1 : LENGTH_ROWS + row)),
];
/** Group of models of each integer: lengths by axis (0-2) and mirrored lengths (3), the same for references (4-7). */
const MODEL_GROUPS = MIRROR_ROWS.flatMap((mirror, row) =>
  [0, 1, 2].map((axis) => (mirror < 0 ? axis : 3) + (row < LENGTH_ROWS ? 0 : 4)),
);
/** Index of the earlier integer that each integer mirrors, or -1. */
const MIRROR_OF = MIRROR_ROWS.flatMap((mirror) => [0, 1, 2].map((axis) => (mirror < 0 ? -1 : 3 * mirror + axis)));

/** A figure and the reference rotation of each joint. */
export interface SkeletonDescription {
  figure: Figure;
  /** Rotation (72, w x y z) that each joint's channel is relative to; the root's applies if the left points along x. */
  reference: Float64Array;
}

/**
 * Decodes a skeleton description.
 *
 * @throws DamagedBlock
 */
export function unpackSkeletonDescription(data: Uint8Array): SkeletonDescription {
  if (data.length < 1 || data.length > MAX_SKELETON_BYTES) {
    throw new DamagedBlock(`Invalid skeleton description: ${data.length} bytes, expected 1..${MAX_SKELETON_BYTES}.`);
  }
  const grid = data[0] >> 4,
    bits = data[0] & 15;
  if (grid > MAX_GRID || bits > MAX_REFERENCE_BITS) {
    throw new DamagedBlock(
      `Invalid skeleton description: grid ${grid}, at most ${MAX_GRID}; ` +
        `${bits} reference bits, at most ${MAX_REFERENCE_BITS}.`,
    );
  }
  const integers = decodeIntegers(data.subarray(1), MODEL_GROUPS, MIRROR_OF);
  const unit = FINEST_GRID_M * 2 ** grid;
  const figure = { offsets: new Float64Array(JOINT_COUNT * 3), tips: new Float64Array(JOINT_COUNT * 3) };
  for (let i = 0; i < JOINT_COUNT * 3; i++) figure.offsets[i] = integers[i] * unit;
  TIP_JOINTS.forEach((joint, tip) => {
    for (let axis = 0; axis < 3; axis++)
      figure.tips[joint * 3 + axis] = integers[(JOINT_COUNT + tip) * 3 + axis] * unit;
  });
  const reference = new Float64Array(JOINT_COUNT * 4);
  for (let joint = 0; joint < JOINT_COUNT; joint++) {
    const [x, y, z] = integers.subarray((LENGTH_ROWS + joint) * 3).map((value) => value * 2 ** -bits);
    fromRotationVector(reference, joint * 4, x, y, z);
  }
  return { figure, reference };
}
