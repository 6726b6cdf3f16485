import { expect, test } from "vitest";
import { ArmRig, LegRig } from "../../src/marionette/limb-rig";
import { figure, table } from "./figure";
import { golden } from "./golden";

function expectNear(actual: Float64Array, expected: number[], tolerance = 1e-9): void {
  expected.forEach((value, i) => expect(Math.abs(actual[i] - value)).toBeLessThan(tolerance));
}

/** Compare three quaternions (12) up to their signs. */
function expectSameRotations(actual: Float64Array, expected: number[][]): void {
  expected.forEach((q, joint) => {
    const dot = q.reduce((sum, value, i) => sum + value * actual[4 * joint + i], 0);
    expectNear(
      actual.slice(4 * joint, 4 * joint + 4).map((value) => value * Math.sign(dot)),
      q,
    );
  });
}

test.each([0, 1] as const)("arm %i equals the golden vectors and its tip is at the target", (limb) => {
  const rig = new ArmRig(figure, limb, table);
  const up = new Float64Array(3),
    tip = new Float64Array(3);
  const joints = new Float64Array(12);
  const cases = golden.limbs.cases.filter((vectorCase) => vectorCase.limb === limb);
  expect(cases.length).toBe(4);
  for (const vectorCase of cases) {
    const rotations = Float64Array.from(vectorCase.rotations.flat()),
      target = Float64Array.from(vectorCase.target!);
    rig.tipTarget(tip, 0, rotations, 4 * rig.firstJointIndex);
    expectNear(tip, vectorCase.own as number[]);
    rig.localUp(up, 0, rotations);
    rig.solve(joints, 0, target, up);
    expectSameRotations(joints, vectorCase.joints);
    rotations.set(joints, 4 * rig.firstJointIndex);
    rig.tipTarget(tip, 0, rotations, 4 * rig.firstJointIndex);
    expectNear(tip, vectorCase.target!);
  }
});

test.each([2, 3] as const)("leg %i equals the golden vectors and its thigh has the angle", (limb) => {
  const rig = new LegRig(figure, limb);
  const joints = new Float64Array(12);
  const cases = golden.limbs.cases.filter((vectorCase) => vectorCase.limb === limb);
  expect(cases.length).toBe(4);
  for (const vectorCase of cases) {
    const rotations = Float64Array.from(vectorCase.rotations.flat());
    expectNear(Float64Array.of(rig.thighAngle(rotations)), [vectorCase.own as number]);
    rig.solve(joints, 0, vectorCase.angle!, rotations);
    expectSameRotations(joints, vectorCase.joints);
    rotations.set(joints, 4 * rig.firstJointIndex);
    expect(Math.abs(rig.thighAngle(rotations) - vectorCase.angle!)).toBeLessThan(1e-9);
  }
});

test("hand straight below the shoulder bends the arm in the forward plane", () => {
  const rig = new ArmRig(figure, 0, table);
  const up = Float64Array.of(0, 1, 0),
    joints = new Float64Array(12),
    positions = new Float64Array(9);
  rig.solve(joints, 0, Float64Array.of(0, -0.7, 0), up);
  rig.jointPositions(positions, 0, joints, 0);
  for (let at = 0; at < 9; at += 3) expect(positions[at]).toBeCloseTo(0, 12);
  // the elbow points backwards
  expect(positions[2]).toBeLessThan(-0.05);
});
