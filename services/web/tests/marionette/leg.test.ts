import * as fc from "fast-check";
import { expect, test } from "vitest";
import { MAX_THIGH_ANGLE_RAD, MIN_THIGH_ANGLE_RAD } from "../../src/marionette/constants";
import { clampThigh, kneeBend } from "../../src/marionette/leg";
import { LegRig } from "../../src/marionette/limb-rig";
import { conjugate, multiply, rotate } from "../../src/motion/rotation";
import { golden } from "./golden";

const angle = fc.double({ min: -10, max: 10, noNaN: true });
const step = fc.double({ min: 0, max: 0.1, noNaN: true });
const figure = {
  offsets: Float64Array.from(golden.limbs.offsets.flat()),
  tips: Float64Array.from(golden.limbs.tips.flat()),
};
const poses = golden.limbs.cases.map(({ rotations }) => Float64Array.from(rotations.flat()));
const pose = fc.constantFrom(...poses);
const limb = fc.constantFrom<2 | 3>(2, 3);

test("knee bends one way and the shank hangs", () => {
  fc.assert(
    fc.property(angle, (theta) => {
      const thigh = clampThigh(theta);
      expect(thigh).toBeGreaterThanOrEqual(MIN_THIGH_ANGLE_RAD);
      expect(thigh).toBeLessThanOrEqual(MAX_THIGH_ANGLE_RAD);
      expect(kneeBend(thigh)).toBeGreaterThanOrEqual(0);
      // angle of the shank from straight down
      expect(thigh - kneeBend(thigh)).toBe(Math.min(thigh, 0));
    }),
  );
});

test("leg angles are continuous in the input", () => {
  fc.assert(
    fc.property(angle, step, (theta, increase) => {
      for (const angleOf of [clampThigh, (value: number) => kneeBend(clampThigh(value))]) {
        const moved = angleOf(theta + increase) - angleOf(theta);
        expect(moved).toBeGreaterThanOrEqual(0);
        expect(moved).toBeLessThanOrEqual(increase + 1e-12);
      }
    }),
  );
});

test("shank hangs, knee never bends backwards, ankle is constant", () => {
  const straight = new Float64Array(12);
  fc.assert(
    fc.property(limb, pose, angle, (legLimb, rotations, theta) => {
      const rig = new LegRig(figure, legLimb),
        joints = new Float64Array(12),
        q = new Float64Array(4),
        link = new Float64Array(3);
      rig.solve(joints, 0, theta, rotations);
      multiply(q, 0, rotations, 0, rotations, 4);
      multiply(q, 0, q, 0, joints, 0);
      rotate(link, 0, q, 0, figure.offsets, 3 * rig.firstJointIndex + 3);
      const thigh = Array.from(link, (part) => part / Math.hypot(...link));
      multiply(q, 0, q, 0, joints, 4);
      rotate(link, 0, q, 0, figure.offsets, 3 * rig.firstJointIndex + 6);
      const shank = Array.from(link, (part) => part / Math.hypot(...link)),
        thighAngle = clampThigh(theta);
      expect(Math.abs(Math.cos(thighAngle) + thigh[1])).toBeLessThan(1e-9);
      const expectedShank = thighAngle >= 0 ? [0, -1, 0] : thigh;
      expectedShank.forEach((part, axis) => expect(Math.abs(part - shank[axis])).toBeLessThan(1e-9));
      rig.solve(straight, 0, 0, poses[0]);
      expect(joints.subarray(8)).toEqual(straight.subarray(8));
    }),
  );
});

test("joints rotate at most as far as the input", () => {
  fc.assert(
    fc.property(limb, pose, angle, step, (legLimb, rotations, theta, increase) => {
      const rig = new LegRig(figure, legLimb),
        before = new Float64Array(12),
        after = new Float64Array(12),
        turn = new Float64Array(4);
      rig.solve(before, 0, theta, rotations);
      rig.solve(after, 0, theta + increase, rotations);
      for (let joint = 0; joint < 12; joint += 4) {
        conjugate(turn, 0, before.slice(joint, joint + 4), 0);
        multiply(turn, 0, turn, 0, after, joint);
        expect(2 * Math.atan2(Math.hypot(turn[1], turn[2], turn[3]), Math.abs(turn[0]))).toBeLessThanOrEqual(
          increase + 1e-7,
        );
      }
    }),
  );
});
