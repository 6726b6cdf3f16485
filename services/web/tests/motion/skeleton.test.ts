import { expect, test } from "vitest";
import { fromRotationVector } from "../../src/motion/rotation";
import {
  copyPose,
  createWorldTransforms,
  figureKey,
  JOINT_COUNT,
  JOINTS,
  LIMB_FIRST_JOINTS,
  LIMBS,
  PARENTS,
  restPose,
  TIP_JOINTS,
  worldTransforms,
} from "../../src/motion/skeleton";

/** Every joint one metre below its parent. */
const figure = { offsets: new Float64Array(JOINT_COUNT * 3), tips: new Float64Array(JOINT_COUNT * 3) };
for (let joint = 0; joint < JOINT_COUNT; joint++) figure.offsets[joint * 3 + 1] = -1;

test("parents come before children, and limbs and tips match the contract", () => {
  expect(JOINTS).toHaveLength(18);
  PARENTS.forEach((parent, joint) => expect(parent).toBeLessThan(joint));
  expect(LIMBS.map((_, limb) => [0, 1, 2].map((nth) => JOINTS[LIMB_FIRST_JOINTS[limb] + nth]))).toEqual([
    ["l_shoulder", "l_elbow", "l_wrist"],
    ["r_shoulder", "r_elbow", "r_wrist"],
    ["l_hip", "l_knee", "l_ankle"],
    ["r_hip", "r_knee", "r_ankle"],
  ]);
  expect(TIP_JOINTS.map((joint) => JOINTS[joint])).toEqual([
    "skullbase",
    "l_wrist",
    "r_wrist",
    "l_midtarsal",
    "r_midtarsal",
  ]);
});

test("at rest all joints hang below the root", () => {
  const pose = restPose();
  pose.root.set([1, 10, 2]);
  const { positions, orientations } = worldTransforms(figure, pose, createWorldTransforms());
  expect([...positions.subarray(42, 45)]).toEqual([1, 6, 2]);
  expect([...orientations.subarray(56, 60)]).toEqual([1, 0, 0, 0]);
});

test("a joint rotates its descendants only", () => {
  const pose = restPose();
  const elbow = JOINTS.indexOf("l_elbow");
  // Lifts the forearm forwards.
  fromRotationVector(pose.rotations, elbow * 4, -Math.PI / 2, 0, 0);
  const at = (joint: string) =>
    [...worldTransforms(figure, pose, createWorldTransforms()).positions.subarray(JOINTS.indexOf(joint) * 3)].slice(
      0,
      3,
    );
  [0, -3, 1].forEach((value, axis) => expect(at("l_wrist")[axis]).toBeCloseTo(value, 12));
  expect(at("l_elbow")).toEqual([0, -3, 0]);
  expect(at("r_wrist")).toEqual([0, -4, 0]);
});

test("copying a pose copies all of it", () => {
  const from = restPose(),
    to = restPose();
  from.root[1] = 3;
  from.rotations[7] = 0.5;
  copyPose(from, to);
  expect(to).toEqual(from);
  expect(to.root).not.toBe(from.root);
});

test("figure keys are equal only for equal lengths", () => {
  const createFigure = () => ({
    offsets: Float64Array.from({ length: 54 }, (_, k) => k / 3),
    tips: new Float64Array(54),
  });
  expect(figureKey(createFigure())).toBe(figureKey(createFigure()));
  const [taller, longer] = [createFigure(), createFigure()];
  taller.offsets[53] += 1e-12;
  longer.tips[0] = 0.2;
  expect(new Set([createFigure(), taller, longer].map(figureKey)).size).toBe(3);
});
