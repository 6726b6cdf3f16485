/** Poses of the arms, for tests. */
import { fromRotationVector } from "../../src/motion/rotation";
import { JOINTS, type Pose, restPose } from "../../src/motion/skeleton";

/** Return a pose with joints turned by rotation vectors, in radians; others are at rest. */
export function poseWith(turns: Readonly<Record<string, readonly [number, number, number]>>): Pose {
  const pose = restPose();
  for (const [joint, turn] of Object.entries(turns))
    fromRotationVector(pose.rotations, JOINTS.indexOf(joint) * 4, ...turn);
  return pose;
}

const QUARTER = Math.PI / 2;
export const ARMS_DOWN = restPose();
/** Both arms straight to the sides. */
export const ARMS_ASIDE = poseWith({ l_shoulder: [0, 0, QUARTER], r_shoulder: [0, 0, -QUARTER] });
/** The left arm straight up. */
export const LEFT_UP = poseWith({ l_shoulder: [0, 0, Math.PI] });
/** The right forearm straight ahead. */
export const RIGHT_FOREARM_AHEAD = poseWith({ r_elbow: [-QUARTER, 0, 0] });
