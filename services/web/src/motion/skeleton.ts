/**
 * The H-Anim LOA-1 figure: a root and 17 joints (`proto/SPEC.md`, 1.4). Right-handed, metres, y up, facing z,
 * its left at +x; at rest every local rotation is the identity and the arms hang down.
 */

import { multiply, rotate } from "./rotation";

/** Joint names in the order of the contract; channel c >= 2 is joint c - 1. */
export const JOINTS: readonly string[] = [
  "humanoid_root",
  "sacroiliac",
  "l_hip",
  "l_knee",
  "l_ankle",
  "l_midtarsal",
  "r_hip",
  "r_knee",
  "r_ankle",
  "r_midtarsal",
  "vl5",
  "skullbase",
  "l_shoulder",
  "l_elbow",
  "l_wrist",
  "r_shoulder",
  "r_elbow",
  "r_wrist",
];

/** Parent of each joint; -1 for the root. */
export const PARENTS: readonly number[] = [-1, 0, 1, 2, 3, 4, 1, 6, 7, 8, 0, 10, 10, 12, 13, 10, 15, 16];

/** Joints with a tip: crown, left hand, right hand, left toes, right toes. */
export const TIP_JOINTS: readonly number[] = [11, 14, 17, 5, 9];

export const JOINT_COUNT = 18;
export const CHANNEL_COUNT = 19;

/** Limbs that puppeteers can hold, in the order of the contract. */
export const LIMBS: readonly string[] = ["left_hand", "right_hand", "left_leg", "right_leg"];

/** First of the three joints of each limb; the others follow it: shoulder elbow wrist, or hip knee ankle. */
export const LIMB_FIRST_JOINTS: readonly number[] = [12, 15, 2, 6];

/**
 * Lengths of a performer in the rest pose, in metres: each joint from its parent (54), each tip from its joint (54,
 * zero for none).
 */
export interface Figure {
  offsets: Float64Array;
  tips: Float64Array;
}

/** Return a key that is equal for figures of equal lengths, so that they share assets. */
export function figureKey({ offsets, tips }: Figure): string {
  return `${offsets.join()} ${tips.join()}`;
}

/** One pose: root position (3) in metres, and a local rotation w x y z per joint (72). */
export interface Pose {
  root: Float64Array;
  rotations: Float64Array;
}

/** World positions (54) in metres and orientations (72) of all joints. */
export interface WorldTransforms {
  positions: Float64Array;
  orientations: Float64Array;
}

/** Return the rest pose at the origin. */
export function restPose(): Pose {
  const rotations = new Float64Array(JOINT_COUNT * 4);
  for (let joint = 0; joint < JOINT_COUNT; joint++) rotations[joint * 4] = 1;
  return { root: new Float64Array(3), rotations };
}

/** Copy a pose. */
export function copyPose(from: Pose, to: Pose): void {
  to.root.set(from.root);
  to.rotations.set(from.rotations);
}

/** Create storage for `worldTransforms`. */
export function createWorldTransforms(): WorldTransforms {
  return { positions: new Float64Array(JOINT_COUNT * 3), orientations: new Float64Array(JOINT_COUNT * 4) };
}

/** Write the world positions and orientations of a pose into `out` and return it. */
export function worldTransforms(figure: Figure, pose: Pose, out: WorldTransforms): WorldTransforms {
  const { positions, orientations } = out;
  for (let i = 0; i < 3; i++) positions[i] = pose.root[i];
  for (let i = 0; i < 4; i++) orientations[i] = pose.rotations[i];
  for (let joint = 1; joint < JOINT_COUNT; joint++) {
    const parent = PARENTS[joint];
    rotate(positions, joint * 3, orientations, parent * 4, figure.offsets, joint * 3);
    for (let i = 0; i < 3; i++) positions[joint * 3 + i] += positions[parent * 3 + i];
    multiply(orientations, joint * 4, orientations, parent * 4, pose.rotations, joint * 4);
  }
  return out;
}
