import { expect, test } from "vitest";
import { ArmRig, LegRig } from "../../src/marionette/limb-rig";
import { figure, table } from "./figure";
import { golden } from "./golden";

function expectNear(got: Float64Array, wanted: number[], tolerance = 1e-9): void {
  wanted.forEach((value, i) => expect(Math.abs(got[i] - value)).toBeLessThan(tolerance));
}

/** Quaternions (12) turn the same whatever their sign. */
function expectSameRotations(got: Float64Array, wanted: number[][]): void {
  wanted.forEach((q, joint) => {
    const along = q.reduce((sum, value, i) => sum + value * got[4 * joint + i], 0);
    expectNear(
      got.slice(4 * joint, 4 * joint + 4).map((value) => value * Math.sign(along)),
      q,
    );
  });
}

test.each([0, 1] as const)("arm %i hangs as the golden vectors say, its tip on the target", (limb) => {
  const rig = new ArmRig(figure, limb, table);
  const up = new Float64Array(3),
    own = new Float64Array(3);
  const joints = new Float64Array(12);
  const cases = golden.limbs.cases.filter((one) => one.limb === limb);
  expect(cases.length).toBe(4);
  for (const one of cases) {
    const rotations = Float64Array.from(one.rotations.flat()),
      target = Float64Array.from(one.target!);
    rig.tipTarget(own, 0, rotations, 4 * rig.firstJointIndex);
    expectNear(own, one.own as number[]);
    rig.localUp(up, 0, rotations);
    rig.solve(joints, 0, target, up);
    expectSameRotations(joints, one.joints);
    rotations.set(joints, 4 * rig.firstJointIndex);
    rig.tipTarget(own, 0, rotations, 4 * rig.firstJointIndex);
    expectNear(own, one.target!);
  }
});

test.each([2, 3] as const)("leg %i hangs as the golden vectors say, its thigh at the angle", (limb) => {
  const rig = new LegRig(figure, limb);
  const joints = new Float64Array(12);
  const cases = golden.limbs.cases.filter((one) => one.limb === limb);
  expect(cases.length).toBe(4);
  for (const one of cases) {
    const rotations = Float64Array.from(one.rotations.flat());
    expectNear(Float64Array.of(rig.thighAngle(rotations)), [one.own as number]);
    rig.solve(joints, 0, one.angle!, rotations);
    expectSameRotations(joints, one.joints);
    rotations.set(joints, 4 * rig.firstJointIndex);
    expect(Math.abs(rig.thighAngle(rotations) - one.angle!)).toBeLessThan(1e-9);
  }
});

test("a hand straight below the shoulder hangs in the plane that faces forwards", () => {
  const rig = new ArmRig(figure, 0, table);
  const up = Float64Array.of(0, 1, 0),
    joints = new Float64Array(12),
    places = new Float64Array(9);
  rig.solve(joints, 0, Float64Array.of(0, -0.7, 0), up);
  rig.jointPositions(places, 0, joints, 0);
  for (let place = 0; place < 9; place += 3) expect(places[place]).toBeCloseTo(0, 12);
  // the elbow goes back
  expect(places[2]).toBeLessThan(-0.05);
});
