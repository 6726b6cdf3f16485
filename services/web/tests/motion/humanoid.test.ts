import * as fc from "fast-check";
import { expect, test } from "vitest";
import {
  BONE_COUNT,
  BONE_PARENTS,
  BONES,
  createHumanoidPose,
  type HumanoidPose,
  toHumanoid,
  tPoseFigure,
} from "../../src/motion/humanoid";
import { fromRotationVector, multiply, rotate } from "../../src/motion/rotation";
import {
  createWorldTransforms,
  JOINT_COUNT,
  JOINTS,
  type Pose,
  restPose,
  TIP_JOINTS,
  worldTransforms,
} from "../../src/motion/skeleton";
import { createStandardFigure } from "../stage/puppet/figures";

const figure = createStandardFigure();
const humanoid = tPoseFigure(figure);
const boneIndex = (name: string) => BONES.indexOf(name);
const boneOfJoint = (name: string) => BONES[JOINTS.indexOf(name) - 1];

/** Return world positions (51) and orientations (68) of a humanoid in the T-pose, by the rules of glTF nodes. */
function humanoidWorld(pose: HumanoidPose): { positions: Float64Array; orientations: Float64Array } {
  const positions = new Float64Array(BONE_COUNT * 3),
    orientations = pose.rotations.slice();
  positions.set(pose.hips);
  for (let b = 1; b < BONE_COUNT; b++) {
    const parent = BONE_PARENTS[b];
    rotate(positions, b * 3, orientations, parent * 4, humanoid.offsets, b * 3);
    for (let i = 0; i < 3; i++) positions[b * 3 + i] += positions[parent * 3 + i];
    multiply(orientations, b * 4, orientations, parent * 4, pose.rotations, b * 4);
  }
  return { positions, orientations };
}

const turn = fc.tuple(...[0, 1, 2].map(() => fc.double({ min: -1.8, max: 1.8, noNaN: true })));
const anyPose: fc.Arbitrary<Pose> = fc
  .record({
    root: fc.tuple(...[0, 1, 2].map(() => fc.double({ min: -9, max: 9, noNaN: true }))),
    turns: fc.array(turn, { minLength: JOINT_COUNT, maxLength: JOINT_COUNT }),
  })
  .map(({ root, turns }) => {
    const pose = restPose();
    pose.root.set(root);
    turns.forEach(([x, y, z], joint) => fromRotationVector(pose.rotations, joint * 4, x, y, z));
    return pose;
  });

function expectNear(some: ArrayLike<number>, others: ArrayLike<number>): void {
  expect(some.length).toBe(others.length);
  for (let i = 0; i < some.length; i++) expect(Math.abs(some[i] - others[i])).toBeLessThan(1e-12);
}

test("bones are the contract's joints with VRM's names and hierarchy", () => {
  expect(BONES).toHaveLength(BONE_COUNT);
  expect(
    [
      "sacroiliac",
      "vl5",
      "skullbase",
      "l_shoulder",
      "l_elbow",
      "l_wrist",
      "r_hip",
      "r_knee",
      "r_ankle",
      "r_midtarsal",
    ].map(boneOfJoint),
  ).toEqual([
    "hips",
    "spine",
    "head",
    "leftUpperArm",
    "leftLowerArm",
    "leftHand",
    "rightUpperLeg",
    "rightLowerLeg",
    "rightFoot",
    "rightToes",
  ]);
  const parent = (name: string) => BONES[BONE_PARENTS[boneIndex(name)]];
  expect(["leftUpperLeg", "spine", "head", "rightUpperArm", "rightHand", "leftToes"].map(parent)).toEqual([
    "hips",
    "hips",
    "spine",
    "spine",
    "rightLowerArm",
    "leftFoot",
  ]);
  expect(BONE_PARENTS[0]).toBe(-1);
});

test("in the T-pose the arms point sideways", () => {
  const [left, right] = ["leftLowerArm", "rightLowerArm"].map((name) =>
    humanoid.offsets.subarray(boneIndex(name) * 3, boneIndex(name) * 3 + 3),
  );
  const figureWorld = figure.offsets.subarray(JOINTS.indexOf("l_elbow") * 3);
  expectNear(left, [-figureWorld[1], figureWorld[0], figureWorld[2]]);
  expectNear(right, [figureWorld[1], figureWorld[0], figureWorld[2]]);
  expect(left[0]).toBeGreaterThan(0.25);
  expect(humanoid.tips[boneIndex("rightHand") * 3]).toBeLessThan(-0.15);
});

test("arms lifted to the sides are the humanoid's rest pose", () => {
  const pose = restPose();
  for (const [name, sign] of [
    ["l_shoulder", 1],
    ["r_shoulder", -1],
  ] as const) {
    fromRotationVector(pose.rotations, JOINTS.indexOf(name) * 4, 0, 0, (sign * Math.PI) / 2);
  }
  const { rotations } = toHumanoid(figure, pose, createHumanoidPose());
  for (let b = 0; b < BONE_COUNT; b++) expectNear(rotations.subarray(b * 4, b * 4 + 4), [1, 0, 0, 0]);
});

test("hips and legs match in any pose; the spine is shifted as a whole", () => {
  fc.assert(
    fc.property(anyPose, (pose) => {
      const figureWorld = worldTransforms(figure, pose, createWorldTransforms());
      const humanoidTransforms = humanoidWorld(toHumanoid(figure, pose, createHumanoidPose()));
      const spine = boneIndex("spine");
      const [shift, tip, theirTip] = [new Float64Array(3), new Float64Array(3), new Float64Array(3)];
      for (let i = 0; i < 3; i++)
        shift[i] = humanoidTransforms.positions[spine * 3 + i] - figureWorld.positions[(spine + 1) * 3 + i];
      for (let b = 0; b < BONE_COUNT; b++) {
        const moved = b < spine ? [0, 0, 0] : shift;
        const at = [0, 1, 2].map((i) => figureWorld.positions[(b + 1) * 3 + i] + moved[i]);
        expectNear(humanoidTransforms.positions.subarray(b * 3, b * 3 + 3), at);
        if (!TIP_JOINTS.includes(b + 1)) continue;
        rotate(tip, 0, figureWorld.orientations, (b + 1) * 4, figure.tips, (b + 1) * 3);
        rotate(theirTip, 0, humanoidTransforms.orientations, b * 4, humanoid.tips, b * 3);
        expectNear(theirTip, tip);
      }
    }),
    { numRuns: 200 },
  );
});

test("with a straight sacroiliac all joints match", () => {
  fc.assert(
    fc.property(anyPose, (pose) => {
      pose.rotations.set([1, 0, 0, 0], JOINTS.indexOf("sacroiliac") * 4);
      const figureWorld = worldTransforms(figure, pose, createWorldTransforms());
      expectNear(
        humanoidWorld(toHumanoid(figure, pose, createHumanoidPose())).positions,
        figureWorld.positions.subarray(3),
      );
    }),
    { numRuns: 50 },
  );
});

test("the figure is not modified", () => {
  const before = figure.offsets.slice();
  tPoseFigure(figure);
  expect(figure.offsets).toEqual(before);
});
