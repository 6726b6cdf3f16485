import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import { MAX_ELBOW_SPEED } from "../../src/marionette/constants";
import { ControlledHand } from "../../src/marionette/controlled-limb";
import { angleBetween, Elbow, liftAngle, verticalNormal } from "../../src/marionette/elbow";
import { ArmRig } from "../../src/marionette/limb-rig";
import { restPose } from "../../src/motion/skeleton";
import { combine, cross, distanceBetween, dot, length, unit } from "../../src/motion/vector";
import { figure, table } from "./figure";

const UP = Float64Array.of(0, 1, 0);
const part = fc.double({ min: -0.6, max: 0.6, noNaN: true });
const position = fc
  .tuple(part, part, part)
  .map((parts) => Float64Array.from(parts))
  .filter((v) => length(v, 0) > 0.4);
const rest = restPose().rotations;

describe("a controlled hand with any target", () => {
  test.each([0, 1] as const)("%i: upper arm stays within the shoulder limit and the tip follows", (limb) => {
    let exact = 0,
      frames = 0;
    fc.assert(
      fc.property(fc.array(position, { minLength: 1, maxLength: 5 }), fc.constantFrom(20, 60, 144), (targets, fps) => {
        const hand = new ControlledHand(figure, limb, table),
          { rig } = hand;
        const joints = new Float64Array(12),
          positions = new Float64Array(9),
          tip = new Float64Array(3);
        for (const target of targets) {
          for (let frame = 0; frame < fps / 2; frame++) {
            hand.observePose(rest, 1 / fps);
            hand.solveJoints(joints, 0, rest, target, 1, 1 / fps);
            rig.jointPositions(positions, 0, joints, 0);
            unit(positions, 0, positions, 0);
            expect(rig.shoulder.depthInCaps(positions)).toBeLessThan(1e-6);
            rig.tipTarget(tip, 0, joints, 0);
            frames++;
            if (distanceBetween(tip, 0, hand.position, 0) < 1e-9) exact++;
          }
        }
      }),
      { numRuns: 25 },
    );
    // behind the back and across the chest the shoulder limit keeps the hand from its target
    expect(exact / frames).toBeGreaterThan(0.5);
  });

  test("tip equals the position of the follower in front of the body", () => {
    const front = fc.tuple(
      fc.double({ min: 0, max: 0.5, noNaN: true }),
      part,
      fc.double({ min: 0.25, max: 0.6, noNaN: true }),
    );
    fc.assert(
      fc.property(fc.array(front, { minLength: 1, maxLength: 5 }), (targets) => {
        const hand = new ControlledHand(figure, 0, table),
          joints = new Float64Array(12),
          tip = new Float64Array(3);
        hand.observePose(rest, 0);
        for (const target of targets) {
          for (let frame = 0; frame < 40; frame++) {
            hand.observePose(rest, 1 / 60);
            hand.solveJoints(joints, 0, rest, Float64Array.from(target), 1, 1 / 60);
          }
          hand.rig.tipTarget(tip, 0, joints, 0);
          expect(distanceBetween(tip, 0, Float64Array.from(target), 0)).toBeLessThan(1e-6);
        }
      }),
      { numRuns: 25 },
    );
  });
});

test("elbow speed is bounded after any jump of the hand", () => {
  const { arm, shoulder } = new ArmRig(figure, 0, table),
    { upper, forearm, hand } = arm.proportions;
  fc.assert(
    fc.property(position, position, fc.constantFrom(1 / 144, 1 / 60, 1 / 20), (from, to, dt) => {
      const elbow = new Elbow(arm, shoulder),
        before = new Float64Array(3),
        now = new Float64Array(3);
      const direction = new Float64Array(3),
        side = new Float64Array(3);
      unit(direction, 0, from, 0);
      elbow.begin(direction, Float64Array.of(-1, 0, 0), 0.6);
      elbow.step(direction, length(from, 0), UP, dt);
      unit(direction, 0, to, 0);
      for (let frame = 0; frame < 80; frame++) {
        const { tip, normal, bend } = elbow.step(direction, length(to, 0), UP, dt);
        const r = length(tip, 0);
        expect(dot(normal, 0, tip, 0)).toBeCloseTo(0, 9);
        // direction of the upper arm from tip, normal and bend
        const square = forearm * forearm + hand * hand + 2 * forearm * hand * Math.cos(bend);
        const along = Math.min(Math.max((upper * upper + r * r - square) / (2 * upper * r), -1), 1);
        cross(side, 0, tip, 0, normal, 0);
        combine(now, 0, tip, 0, along / r, side, 0, Math.sqrt(1 - along * along) / r);
        if (frame > 0) expect(angleBetween(now, before) * upper).toBeLessThanOrEqual(1.01 * MAX_ELBOW_SPEED * dt);
        before.set(now);
      }
    }),
    { numRuns: 60 },
  );
});

test("verticalNormal returns false on the vertical axis", () => {
  const out = Float64Array.of(7, 8, 9);
  expect(verticalNormal(out, Float64Array.of(0, -1, 0), UP)).toBe(false);
  expect([...out]).toEqual([7, 8, 9]);
});

test("liftAngle is the angle between elbow and chord", () => {
  const direction = Float64Array.of(0, 0, 1);
  expect(liftAngle(Float64Array.of(0, -2, 2), direction)).toBeCloseTo(Math.PI / 4, 12);
  expect(liftAngle(Float64Array.of(0, 0, 3), direction)).toBe(0);
});
