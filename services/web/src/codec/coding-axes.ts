/** Axes in which rotations are coded, which have the same meaning on every skeleton (`proto/codec.md`, 2.6). */

import { multiply, rotate, toMatrix } from "../motion/rotation";
import { type Figure, JOINT_COUNT, JOINTS, PARENTS, TIP_JOINTS } from "../motion/skeleton";
import { cross, dot, length, rotationBetween, setVector, unit } from "../motion/vector";

const UPWARD_JOINTS = ["sacroiliac", "vl5", "skullbase"].map((name) => JOINTS.indexOf(name));
const HINGE_JOINTS = ["l_", "r_"].flatMap((side) =>
  ["knee", "ankle", "midtarsal", "elbow", "wrist"].map((name) => JOINTS.indexOf(side + name)),
);
/** Length below which a bone has no direction; no bone on a grid has exactly this length. */
const MIN_BONE_LENGTH_M = 0.00095;

/**
 * Returns the rotation matrices [joint 18][3][3] from each joint's own frame to the axes in which it is coded. A joint
 * with one bone has its hinge, the bone, and their normal as axes. Other joints have the left, up and forward direction
 * of the figure in its reference pose (72).
 */
export function codingAxes(figure: Figure, reference: Float64Array): Float64Array {
  const world = reference.slice();
  const axes = new Float64Array(JOINT_COUNT * 9);
  for (let joint = 0; joint < JOINT_COUNT; joint++) {
    if (joint > 0) multiply(world, joint * 4, world, PARENTS[joint] * 4, reference, joint * 4);
    toMatrix(axes, joint * 9, world, joint * 4);
  }
  const orientation = axes.slice();
  for (let joint = 0; joint < JOINT_COUNT; joint++) {
    const arms = PARENTS.flatMap((parent, child) =>
      parent === joint ? [figure.offsets.subarray(child * 3, child * 3 + 3)] : [],
    );
    if (TIP_JOINTS.includes(joint)) arms.push(figure.tips.subarray(joint * 3, joint * 3 + 3));
    const own = axes.subarray(joint * 9, joint * 9 + 9);
    const bone = arms.length === 1 ? unitDirection(own, arms[0]) : null;
    if (!bone) continue;
    const offset = figure.offsets.subarray(joint * 3, joint * 3 + 3);
    const parentBone = HINGE_JOINTS.includes(joint)
      ? unitDirection(orientation.subarray(PARENTS[joint] * 9), offset)
      : null;
    own.set(multiplyMatrices(boneAxes(bone, UPWARD_JOINTS.includes(joint), parentBone), own));
  }
  return axes;
}

/** Returns the product of two matrices [3][3]. */
export function multiplyMatrices(a: Float64Array, b: Float64Array): Float64Array {
  return Float64Array.from({ length: 9 }, (_, i) => {
    const row = i - (i % 3),
      column = i % 3;
    return a[row] * b[column] + a[row + 1] * b[column + 3] + a[row + 2] * b[column + 6];
  });
}

/** Returns the unit vector of `arm` multiplied by `matrix`, or null if it is too short. */
function unitDirection(matrix: Float64Array, arm: Float64Array): Float64Array | null {
  const turned = Float64Array.from([0, 3, 6], (row) => dot(matrix, row, arm, 0));
  return unit(turned, 0, turned, 0, MIN_BONE_LENGTH_M) ? turned : null;
}

/**
 * Returns axes (rows) of which the second points along `bone`. They are the world axes of a bone that points straight
 * down (`isUpward`: up), carried by the shortest rotation. If the bone and its parent form an angle, the axes turn
 * about the bone until the first is the hinge between the two.
 */
function boneAxes(bone: Float64Array, isUpward: boolean, parentBone: Float64Array | null): Float64Array {
  const axes = Float64Array.of(1, 0, 0, 0, 1, 0, 0, 0, 1);
  const up = isUpward ? 1 : -1;
  // almost opposite: the shortest rotation is ambiguous
  const sign = up * bone[1] > -0.8 ? 1 : -1;
  const turn = new Float64Array(4),
    hinge = new Float64Array(3);
  rotationBetween(turn, 0, Float64Array.of(0, sign * up, 0), 0, bone, 0);
  for (let axis = 0; axis < 9; axis += 3) rotate(axes, axis, turn, 0, axes, axis);
  if (sign < 0) for (let i = 3; i < 9; i++) axes[i] = -axes[i];
  if (parentBone) cross(hinge, 0, parentBone, 0, bone, 0);
  const sine = length(hinge, 0);
  if (sine > 0.2) {
    const scale = (dot(hinge, 0, axes, 0) < -1e-6 ? -1 : 1) / sine;
    setVector(axes, 0, hinge[0] * scale, hinge[1] * scale, hinge[2] * scale);
    cross(axes, 6, axes, 0, axes, 3);
  }
  return axes;
}
