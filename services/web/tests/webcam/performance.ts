/** What the person before the fake camera does: a pose for each moment, and where the hands are in it. Pure. */
import { Euler, MathUtils, Quaternion, Vector3 } from "three";
import { JOINTS, type Pose, restPose } from "../../src/motion/skeleton";
import { jointPosition } from "../../src/stage/puppet/standard-figure";

/**
 * Posture of an arm in degrees: raised sideways, raised forwards, turned about the upper arm (so that a bent forearm
 * points upwards rather than forwards), and bend of the elbow.
 */
type Arm = readonly [sideways: number, forwards: number, turn: number, bend: number];

const DOWN: Arm = [7, 2, 0, 6];
const ASIDE: Arm = [84, 4, 0, 8];
const UP: Arm = [158, 5, 0, 14];
const AHEAD: Arm = [10, 78, 0, 12];
const WAVE_IN: Arm = [66, 22, 84, 108];
const WAVE_OUT: Arm = [70, 20, 84, 62];
const CHEST: Arm = [28, 26, -42, 108];
const FOREARM_AHEAD: Arm = [10, 12, 0, 84];
const DIAGONAL: Arm = [42, 34, 10, 26];

/** Postures of the left and right arm, and the time in seconds to reach them. Each is held for `HOLD_S`. */
const POSTURES: readonly (readonly [left: Arm, right: Arm, seconds: number])[] = [
  [DOWN, WAVE_IN, 0.9],
  [DOWN, WAVE_OUT, 0.5],
  [DOWN, WAVE_IN, 0.5],
  [ASIDE, ASIDE, 0.9],
  [UP, UP, 0.9],
  [DIAGONAL, DIAGONAL, 1],
  [CHEST, CHEST, 0.8],
  [FOREARM_AHEAD, FOREARM_AHEAD, 0.7],
  [AHEAD, DOWN, 0.9],
  [DOWN, AHEAD, 1],
  [UP, ASIDE, 1],
  [WAVE_OUT, CHEST, 0.8],
  [WAVE_IN, DIAGONAL, 0.6],
  [DOWN, DOWN, 1],
];
const HOLD_S = 0.35;
/** The person stands still first: this is what the page calibrates by. */
export const STILL_S = 3;
/** Duration of the performance, after which it repeats. */
export const PERFORMANCE_S = STILL_S + POSTURES.reduce((sum, [, , seconds]) => sum + seconds + HOLD_S, 0);

/** Return the pose after `seconds` of the performance. */
export function performancePose(seconds: number): Pose {
  const pose = restPose();
  jointPosition("humanoid_root").toArray(pose.root);
  const [left, right] = armsAt(seconds % PERFORMANCE_S);
  // The body is never quite still: it breathes and sways.
  setRotation(pose, "humanoid_root", new Euler(0, MathUtils.degToRad(3) * Math.sin(seconds * 0.9), 0));
  setRotation(pose, "vl5", new Euler(MathUtils.degToRad(1) * Math.sin(seconds * 1.7), 0, 0));
  setRotation(pose, "skullbase", new Euler(0, MathUtils.degToRad(8) * Math.sin(seconds * 0.7), 0));
  setArm(pose, "l", left);
  setArm(pose, "r", right);
  return pose;
}

function armsAt(seconds: number): [Arm, Arm] {
  let [left, right]: [Arm, Arm] = [DOWN, DOWN];
  let start = STILL_S;
  for (const [nextLeft, nextRight, duration] of POSTURES) {
    if (seconds <= start) break;
    const share = MathUtils.smootherstep(seconds, start, start + duration);
    left = mix(left, nextLeft, share);
    right = mix(right, nextRight, share);
    start += duration + HOLD_S;
  }
  return [left, right];
}

function mix(from: Arm, to: Arm, share: number): Arm {
  return from.map((value, index) => MathUtils.lerp(value, to[index], share)) as unknown as Arm;
}

function setArm(pose: Pose, side: "l" | "r", [sideways, forwards, turn, bend]: Arm): void {
  const sign = side === "l" ? 1 : -1;
  const radians = MathUtils.degToRad;
  const axis = (x: number, y: number, z: number, degrees: number) =>
    new Quaternion().setFromAxisAngle(new Vector3(x, y, z), radians(degrees));
  const shoulder = axis(0, 0, sign, sideways)
    .multiply(axis(1, 0, 0, -forwards))
    .multiply(axis(0, sign, 0, turn));
  setQuaternion(pose, `${side}_shoulder`, shoulder);
  setQuaternion(pose, `${side}_elbow`, axis(1, 0, 0, -bend));
}

function setRotation(pose: Pose, joint: string, turn: Euler): void {
  setQuaternion(pose, joint, new Quaternion().setFromEuler(turn));
}

function setQuaternion(pose: Pose, joint: string, { w, x, y, z }: Quaternion): void {
  pose.rotations.set([w, x, y, z], JOINTS.indexOf(joint) * 4);
}
