/** Bodies for property tests: poses of a figure within human limits, and the landmarks that they have. */
import * as fc from "fast-check";
import { fromRotationVector, multiply, rotate } from "../../src/motion/rotation";
import {
  createWorldTransforms,
  type Figure,
  JOINTS,
  type Pose,
  restPose,
  worldTransforms,
} from "../../src/motion/skeleton";
import { LANDMARK, LANDMARK_COUNT, LANDMARK_STRIDE, type LandmarkName } from "../../src/webcam/landmark";

/** Return the position of a point in the axes of a joint. */
type FindPoint = (joint: string, offset?: readonly [number, number, number]) => Float64Array;

const HEAD_EARS: readonly (readonly [LandmarkName, readonly [number, number, number]])[] = [
  ["leftEar", [0.07, 0.06, 0]],
  ["rightEar", [-0.07, 0.06, 0]],
  ["nose", [0, 0.06 - 0.1 * Math.tan(0.2), 0.1]],
];

/** Return the world landmarks (132) of a figure in a pose, all visible, in the axes of the detector. */
export function landmarksOf(figure: Figure, pose: Pose, visibility = 1): Float64Array {
  const { positions, orientations } = worldTransforms(figure, pose, createWorldTransforms());
  const find: FindPoint = (joint, offset = [0, 0, 0]) => {
    const index = JOINTS.indexOf(joint);
    const out = new Float64Array(3);
    rotate(out, 0, orientations, index * 4, Float64Array.from(offset), 0);
    return out.map((value, axis) => value + positions[index * 3 + axis]);
  };
  const points = new Map<LandmarkName, Float64Array>(
    HEAD_EARS.map(([name, offset]) => [name, find("skullbase", offset)]),
  );
  for (const side of ["left", "right"] as const) {
    const prefix = side === "left" ? "l" : "r";
    const sign = side === "left" ? 1 : -1;
    points.set(`${side}Shoulder`, find(`${prefix}_shoulder`));
    points.set(`${side}Elbow`, find(`${prefix}_elbow`));
    points.set(`${side}Wrist`, find(`${prefix}_wrist`));
    points.set(`${side}Index`, find(`${prefix}_wrist`, [0, -0.09, 0.03]));
    points.set(`${side}Pinky`, find(`${prefix}_wrist`, [0, -0.09, -0.03]));
    points.set(`${side}Thumb`, find(`${prefix}_wrist`, [-0.02 * sign, -0.06, 0.04]));
    points.set(`${side}Hip`, find(`${prefix}_hip`));
    points.set(`${side}Knee`, find(`${prefix}_knee`));
    points.set(`${side}Ankle`, find(`${prefix}_ankle`));
    points.set(`${side}Heel`, find(`${prefix}_ankle`, [0, -0.05, -0.05]));
    points.set(`${side}Toes`, find(`${prefix}_ankle`, [0, -0.05, 0.15]));
  }
  const hips = [0, 1, 2].map((axis) => {
    const [left, right] = [points.get("leftHip"), points.get("rightHip")] as Float64Array[];
    return (left[axis] + right[axis]) / 2;
  });
  const landmarks = new Float64Array(LANDMARK_COUNT * LANDMARK_STRIDE);
  for (const [name, point] of points) {
    const [x, y, z] = point.map((value, axis) => value - hips[axis]);
    landmarks.set([x, -y, -z, visibility], LANDMARK[name] * LANDMARK_STRIDE);
  }
  return landmarks;
}

const angle = (limit: number) => fc.double({ min: -limit, max: limit, noNaN: true });
const bend = fc.double({ min: 0.5, max: 2.2, noNaN: true });
const turn = (limit: number) => fc.tuple(angle(limit), angle(limit), angle(limit));

function setTurn(pose: Pose, joint: string, [x, y, z]: readonly number[]): void {
  fromRotationVector(pose.rotations, JOINTS.indexOf(joint) * 4, x, y, z);
}

/**
 * Poses whose landmarks determine every rotation: arms and legs are bent, the spine is straight up to a turn of the
 * chest about it, and the whole body is turned.
 */
export const determinedPose: fc.Arbitrary<Pose> = fc
  .record({
    body: turn(1.2),
    chestYaw: angle(0.6),
    head: turn(0.5),
    shoulders: fc.tuple(turn(0.5), turn(0.5)),
    hips: fc.tuple(turn(0.4), turn(0.4)),
    elbows: fc.tuple(bend, bend),
    knees: fc.tuple(bend, bend),
    hands: fc.tuple(turn(0.6), turn(0.6)),
    feet: fc.tuple(angle(0.5), angle(0.5)),
  })
  .map(({ body, chestYaw, head, shoulders, hips, elbows, knees, hands, feet }) => {
    const pose = restPose();
    setTurn(pose, "humanoid_root", body);
    setTurn(pose, "vl5", [0, chestYaw, 0]);
    setTurn(pose, "skullbase", head);
    (["l", "r"] as const).forEach((side, index) => {
      setTurn(pose, `${side}_shoulder`, shoulders[index]);
      setTurn(pose, `${side}_hip`, hips[index]);
      setTurn(pose, `${side}_elbow`, [-elbows[index], 0, 0]);
      setTurn(pose, `${side}_knee`, [knees[index], 0, 0]);
      setTurn(pose, `${side}_wrist`, hands[index]);
      setTurn(pose, `${side}_ankle`, [feet[index], 0, 0]);
    });
    return pose;
  });

/** Any poses, also ones that no body can take. */
export const anyPose: fc.Arbitrary<Pose> = fc
  .array(turn(Math.PI), { minLength: JOINTS.length, maxLength: JOINTS.length })
  .map((turns) => {
    const pose = restPose();
    turns.forEach((vector, joint) => void setTurn(pose, JOINTS[joint], vector));
    return pose;
  });

/** Return the pose with the whole body turned by `radians` about the vertical. */
export function turned(pose: Pose, radians: number): Pose {
  const rotations = pose.rotations.slice();
  multiply(rotations, 0, Float64Array.of(Math.cos(radians / 2), 0, Math.sin(radians / 2), 0), 0, rotations, 0);
  return { root: pose.root, rotations };
}
