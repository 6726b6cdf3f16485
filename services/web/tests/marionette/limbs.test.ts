import { expect, test } from "vitest";
import { readTable } from "../../src/marionette/arm";
import { ArmRig, LegRig, armProportions } from "../../src/marionette/limbs";
import { bytes } from "../vectors";
import { golden } from "./golden";

const figure = {
  offsets: Float64Array.from(golden.limbs.offsets.flat()),
  tips: Float64Array.from(golden.limbs.tips.flat()),
};
const identity = armProportions(figure, 0).identity;
const table = readTable(bytes(golden.arms.find((arm) => arm.proportions === identity)!.table));

function near(got: Float64Array, wanted: number[], least = 1e-9): void {
  wanted.forEach((value, i) => expect(Math.abs(got[i] - value)).toBeLessThan(least));
}

/** Quaternions (12) turn the same whatever their sign. */
function sameRotations(got: Float64Array, wanted: number[][]): void {
  wanted.forEach((q, joint) => {
    const along = q.reduce((sum, value, i) => sum + value * got[4 * joint + i], 0);
    near(got.slice(4 * joint, 4 * joint + 4).map((value) => value * Math.sign(along)), q);
  });
}

test.each([0, 1] as const)("arm %i hangs as the golden vectors say, its tip on the target", (limb) => {
  const rig = new ArmRig(figure, limb, table);
  const up = new Float64Array(3), normal = new Float64Array(3), own = new Float64Array(3);
  const joints = new Float64Array(12);
  const cases = golden.limbs.cases.filter((one) => one.limb === limb);
  expect(cases.length).toBe(4);
  for (const one of cases) {
    const rotations = Float64Array.from(one.rotations.flat()), target = Float64Array.from(one.target!);
    rig.target(own, 0, rotations);
    near(own, one.own as number[]);
    rig.up(up, 0, rotations);
    rig.restingNormal(normal, 0, target, 0, up, 0);
    rig.hang(joints, 0, target, 0, up, 0, normal, 0);
    sameRotations(joints, one.joints);
    rotations.set(joints, 4 * rig.shoulder);
    rig.target(own, 0, rotations);
    near(own, one.target!);
  }
});

test.each([2, 3] as const)("leg %i hangs as the golden vectors say, its thigh at the angle", (limb) => {
  const rig = new LegRig(figure, limb);
  const joints = new Float64Array(12);
  const cases = golden.limbs.cases.filter((one) => one.limb === limb);
  expect(cases.length).toBe(4);
  for (const one of cases) {
    const rotations = Float64Array.from(one.rotations.flat());
    near(Float64Array.of(rig.angle(rotations)), [one.own as number]);
    rig.hang(joints, 0, one.angle!, rotations);
    sameRotations(joints, one.joints);
    rotations.set(joints, 4 * rig.hip);
    expect(Math.abs(rig.angle(rotations) - one.angle!)).toBeLessThan(1e-9);
  }
});

test("a hand straight below the shoulder hangs in the plane that faces forwards", () => {
  const rig = new ArmRig(figure, 0, table);
  const up = Float64Array.of(0, 1, 0), target = Float64Array.of(0, -0.7, 0), normal = new Float64Array(3);
  rig.restingNormal(normal, 0, target, 0, up, 0);
  near(normal, [-1, 0, 0]);
});
