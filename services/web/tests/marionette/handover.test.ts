import * as fc from "fast-check";
import { expect, test } from "vitest";
import { BLEND_IN_S, BLEND_OUT_S } from "../../src/marionette/constants";
import {
  DirectionAlignment,
  Handover,
  JointBlend,
  minimumJerk,
  returnAcceleration,
} from "../../src/marionette/handover";
import { rotate } from "../../src/motion/rotation";
import { distanceBetween, normalise, unit } from "../../src/motion/vector";

const part = fc.double({ min: -1, max: 1, noNaN: true });
const direction = fc
  .tuple(part, part, part)
  .map((parts) => Float64Array.from(parts))
  .filter((v) => unit(v, 0, v, 0, 0.1));

test("weight rises in 150 ms and falls in 350 ms without a step", () => {
  const handover = new Handover();
  expect([BLEND_IN_S, BLEND_OUT_S]).toEqual([0.15, 0.35]);
  handover.advance(true, 0.075);
  expect(handover.weight).toBe(0.5);
  handover.advance(true, 0.075);
  expect(handover.weight).toBe(1);
  handover.advance(false, 0.175);
  expect(handover.progress).toBeCloseTo(0.5, 12);
  handover.advance(false, 1);
  expect(handover.weight).toBe(0);
  for (let x = 0; x < 1; x += 0.01) expect(minimumJerk(x + 0.01) - minimumJerk(x)).toBeLessThan(0.019);
});

test("return takes 0.28 s within the bounds of the acceleration", () => {
  const returnDuration = (distance: number, speed: number, a: number) => {
    const farthest = distance + (speed * speed) / (2 * a);
    return speed / a + 2 * Math.sqrt(farthest / a);
  };
  fc.assert(
    fc.property(
      fc.double({ min: 0, max: 2, noNaN: true }),
      fc.double({ min: 0, max: 5, noNaN: true }),
      (distance, speed) => {
        const a = returnAcceleration(distance, speed, 60);
        expect(a).toBeGreaterThanOrEqual(6);
        expect(a).toBeLessThanOrEqual(60);
        if (a > 6.001 && a < 59.999) expect(returnDuration(distance, speed, a)).toBeCloseTo(0.28, 3);
      },
    ),
  );
});

test("alignment rotates motion to control continuously", () => {
  fc.assert(
    fc.property(direction, direction, direction, (motion, begin, end) => {
      const turn = new DirectionAlignment(),
        controlled = new Float64Array(3),
        q = new Float64Array(4),
        rotated = new Float64Array(3);
      const before = new Float64Array(4);
      for (let step = 0; step <= 100; step++) {
        for (let i = 0; i < 3; i++) controlled[i] = begin[i] + (end[i] - begin[i]) * (step / 100);
        if (!unit(controlled, 0, controlled, 0, 0.3)) return;
        turn.update(q, 0, motion, controlled, 0.999);
        rotate(rotated, 0, q, 0, motion, 0);
        // directions within 1e-6 of opposite count as opposite
        expect(distanceBetween(rotated, 0, controlled, 0)).toBeLessThan(2e-6);
        // q and -q are the same rotation
        const dot = before.reduce((sum, value, i) => sum + value * q[i], 0);
        if (step > 0) expect(Math.abs(dot)).toBeGreaterThan(0.97);
        before.set(q);
      }
      // at weight 0 the alignment is the shortest rotation
      turn.update(q, 0, motion, controlled, 0);
      const angle = 2 * Math.acos(Math.min(Math.abs(q[0]), 1));
      const expectedAngle = 2 * Math.asin(Math.min(distanceBetween(motion, 0, controlled, 0) / 2, 1));
      expect(angle).toBeCloseTo(expectedAngle, 5);
    }),
    { numRuns: 40 },
  );
});

test("joint blend is exact at weights 0 and 1", () => {
  const first = Float64Array.from({ length: 12 }, (_, i) => Math.sin(i + 1)),
    second = first.map((value, i) => value + Math.cos(i));
  for (const joints of [first, second]) for (const at of [0, 4, 8]) normalise(joints, at);
  const out = new Float64Array(12),
    jointBlend = new JointBlend();
  jointBlend.blend(out, 0, first, 0, second, 0, 0);
  expect(out).toEqual(first);
  jointBlend.blend(out, 0, first, 0, second, 0, 1);
  expect(out).toEqual(second);
  jointBlend.blend(out, 0, first, 0, second, 0, 0.3);
  for (const at of [0, 4, 8]) expect(Math.hypot(...out.subarray(at, at + 4))).toBeCloseTo(1, 12);
});
