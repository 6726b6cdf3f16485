import { describe, expect, test } from "vitest";
import { BondedArm, settle } from "../../src/marionette/bonded-arm";
import { toPlace, toWorld } from "../../src/marionette/carrier";
import { ControlledHand } from "../../src/marionette/controlled-limb";
import { distanceOf, type Point } from "../../src/marionette/point";
import { createWorldTransforms, restPose, worldTransforms } from "../../src/motion/skeleton";
import { figure, table } from "./figure";

const SHOULDERS = [12, 15] as const;

function makeArm(limb: 0 | 1, seconds = 1 / 60) {
  const hand = new ControlledHand(figure, limb, table),
    pose = restPose();
  pose.root.set([0.4, 0.9, -0.2]);
  pose.rotations.set([Math.cos(0.4), 0, Math.sin(0.4), 0], 0);
  hand.observePose(pose.rotations, 0);
  return { hand, pose, arm: new BondedArm(hand, pose, seconds) };
}

describe("the arm of a bonded hand", () => {
  test.each([0, 1] as const)("has the shoulder of limb %i's pose", (limb) => {
    const { arm, pose, hand } = makeArm(limb);
    const { positions } = worldTransforms(figure, pose, createWorldTransforms());
    const at = 3 * SHOULDERS[limb];
    arm.shoulder.position.forEach((value, axis) => expect(value).toBeCloseTo(positions[at + axis], 12));
    expect(arm.shoulder.armLengthM).toBe(hand.rig.armLengthM);
  });

  test("rests where the motion has it until something moves it, then goes on", () => {
    const { arm, hand } = makeArm(0);
    expect([...arm.motion.place]).toEqual([...hand.position]);
    const joints = new Float64Array(12);
    const place: Point = [0.2, -0.3, 0.5];
    const { pose } = makeArm(0);
    hand.solveBondedJoints(joints, 0, pose.rotations, [0.2, -0.3, 0.48], 1, 1 / 60);
    hand.solveBondedJoints(joints, 0, pose.rotations, place, 1, 1 / 60);
    expect([...hand.position]).toEqual(place);
    [0.2, -0.3, 0.52].forEach((value, axis) => expect(arm.motion.place[axis]).toBeCloseTo(value, 12));
  });

  test("tells what it reaches without moving", () => {
    const { arm, hand, pose } = makeArm(0);
    const joints = [new Float64Array(12), new Float64Array(12)];
    const ahead = toWorld(arm.shoulder, [0.3, 0.1, 0.6]);
    const behind = toWorld(arm.shoulder, [-0.2, 0.2, -0.8]);
    hand.solveBondedJoints(joints[0], 0, pose.rotations, [0.3, 0.1, 0.6], 1, 0);
    expect(distanceOf(arm.reachablePosition(ahead), ahead)).toBeLessThan(1e-9);
    expect(distanceOf(arm.reachablePosition(behind), behind)).toBeGreaterThan(0.01);
    hand.solveBondedJoints(joints[1], 0, pose.rotations, [0.3, 0.1, 0.6], 1, 0);
    joints[0].forEach((value, i) => expect(joints[1][i]).toBeCloseTo(value, 12));
  });
});

test("two arms settle where both reach", () => {
  const [first, second] = [makeArm(0), makeArm(1)];
  const between = toWorld(first.arm.shoulder, [-0.3, 0, 0.6]);
  for (const { arm, hand, pose } of [first, second]) {
    const place = toPlace(arm.shoulder, between);
    hand.solveBondedJoints(new Float64Array(12), 0, pose.rotations, place, 1, 0);
  }
  expect(distanceOf(settle(first.arm, second.arm, between), between)).toBeLessThan(1e-9);
});
