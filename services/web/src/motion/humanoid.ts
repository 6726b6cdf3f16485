/**
 * The contract's figure as a VRM 1.0 humanoid, for avatars and files: its rest pose is the T-pose, and every local
 * rotation is relative to it. Both face z with the left at +x, in metres (https://github.com/vrm-c/vrm-specification,
 * VRMC_vrm-1.0, humanoid.md).
 *
 * Bone b is joint b + 1: the hips are the sacroiliac, and the root, which a humanoid does not have, is merged into
 * them. Lengths along the legs do not change. The spine hangs from the root in the figure, but from the hips here:
 * where the sacroiliac is bent, the spine and everything above it move accordingly.
 */

import { conjugate, multiply, type Numbers, rotate } from "./rotation";
import { type Figure, JOINT_COUNT, JOINTS, PARENTS, type Pose } from "./skeleton";

/** Names of the humanoid's bones; parents come before their children. */
export const BONES: readonly string[] = [
  "hips",
  "leftUpperLeg",
  "leftLowerLeg",
  "leftFoot",
  "leftToes",
  "rightUpperLeg",
  "rightLowerLeg",
  "rightFoot",
  "rightToes",
  "spine",
  "head",
  "leftUpperArm",
  "leftLowerArm",
  "leftHand",
  "rightUpperArm",
  "rightLowerArm",
  "rightHand",
];

export const BONE_COUNT = JOINT_COUNT - 1;

/** Parent of each bone; -1 for the hips. */
export const BONE_PARENTS: readonly number[] = PARENTS.slice(1).map((parent, bone) =>
  bone === 0 ? -1 : Math.max(0, parent - 1),
);

const SACROILIAC = JOINTS.indexOf("sacroiliac"),
  SPINE = JOINTS.indexOf("vl5");
const LEFT_ARM = JOINTS.indexOf("l_shoulder"),
  RIGHT_ARM = JOINTS.indexOf("r_shoulder");

/** Rotation of each joint's bone from the T-pose to the figure's rest pose (72): for an arm, 90 degrees about z. */
export const T_POSE_TO_REST: Numbers = new Float64Array(JOINT_COUNT * 4);
for (let joint = 0; joint < JOINT_COUNT; joint++) {
  T_POSE_TO_REST[joint * 4] = joint < LEFT_ARM ? 1 : Math.SQRT1_2;
  T_POSE_TO_REST[joint * 4 + 3] = joint < LEFT_ARM ? 0 : joint < RIGHT_ARM ? -Math.SQRT1_2 : Math.SQRT1_2;
}

/**
 * One pose: world position of the hips (3) in metres, and a rotation w x y z per bone (68), that of the hips in the
 * world frame, others in their parent's.
 */
export interface HumanoidPose {
  hips: Float64Array;
  rotations: Float64Array;
}

/** Create storage for `toHumanoid`. */
export function createHumanoidPose(): HumanoidPose {
  return { hips: new Float64Array(3), rotations: new Float64Array(BONE_COUNT * 4) };
}

const inverseRotation = new Float64Array(4);

/** Convert a pose of `figure` to the humanoid's, into `out`, and return it. */
export function toHumanoid(figure: Figure, pose: Pose, out: HumanoidPose): HumanoidPose {
  const { hips, rotations } = out;
  const jointRotations = pose.rotations;
  rotate(hips, 0, jointRotations, 0, figure.offsets, SACROILIAC * 3);
  for (let i = 0; i < 3; i++) hips[i] += pose.root[i];
  for (let joint = SACROILIAC; joint < JOINT_COUNT; joint++) {
    const at = (joint - 1) * 4;
    if (joint === SACROILIAC) {
      multiply(rotations, at, jointRotations, 0, jointRotations, joint * 4);
    } else if (joint === SPINE) {
      conjugate(inverseRotation, 0, jointRotations, SACROILIAC * 4);
      multiply(rotations, at, inverseRotation, 0, jointRotations, joint * 4);
    } else {
      conjugate(inverseRotation, 0, T_POSE_TO_REST, PARENTS[joint] * 4);
      multiply(rotations, at, inverseRotation, 0, jointRotations, joint * 4);
      multiply(rotations, at, rotations, at, T_POSE_TO_REST, joint * 4);
    }
  }
  return out;
}

/**
 * Lengths of a humanoid in the T-pose, in metres: each bone from its parent (51; the hips from the floor below the
 * root), each tip from its bone (51, zero for none).
 */
export interface HumanoidFigure {
  offsets: Float64Array;
  tips: Float64Array;
}

/** Return `figure` in the T-pose. */
export function tPoseFigure(figure: Figure): HumanoidFigure {
  const offsets = figure.offsets.slice(3),
    tips = figure.tips.slice(3);
  for (let i = 0; i < 3; i++) {
    offsets[i] += figure.offsets[i];
    offsets[(SPINE - 1) * 3 + i] -= figure.offsets[SACROILIAC * 3 + i];
  }
  for (let joint = LEFT_ARM; joint < JOINT_COUNT; joint++) {
    rotateToTPose(offsets, (joint - 1) * 3, PARENTS[joint]);
    rotateToTPose(tips, (joint - 1) * 3, joint);
  }
  return { offsets, tips };
}

/** Rotate the vector at `at`, carried by `joint`, from the figure's rest pose to the T-pose. */
function rotateToTPose(vectors: Numbers, at: number, joint: number): void {
  conjugate(inverseRotation, 0, T_POSE_TO_REST, joint * 4);
  rotate(vectors, at, inverseRotation, 0, vectors, at);
}
