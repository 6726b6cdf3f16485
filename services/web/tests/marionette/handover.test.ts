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

test("a limb is taken in 150 ms and given back in 350, without a step", () => {
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

test("the way home takes 0.28 s where the bounds let it, whatever the speed", () => {
  const home = (away: number, speed: number, a: number) => {
    const turned = away + (speed * speed) / (2 * a);
    return speed / a + 2 * Math.sqrt(turned / a);
  };
  fc.assert(
    fc.property(
      fc.double({ min: 0, max: 2, noNaN: true }),
      fc.double({ min: 0, max: 5, noNaN: true }),
      (away, speed) => {
        const a = returnAcceleration(away, speed, 60);
        expect(a).toBeGreaterThanOrEqual(6);
        expect(a).toBeLessThanOrEqual(60);
        if (a > 6.001 && a < 59.999) expect(home(away, speed, a)).toBeCloseTo(0.28, 3);
      },
    ),
  );
});

test("the turn brings the one hand to the other all along, without changing sides", () => {
  fc.assert(
    fc.property(direction, direction, direction, (dance, begin, end) => {
      const turn = new DirectionAlignment(),
        pulled = new Float64Array(3),
        q = new Float64Array(4),
        got = new Float64Array(3);
      const before = new Float64Array(4);
      for (let step = 0; step <= 100; step++) {
        for (let i = 0; i < 3; i++) pulled[i] = begin[i] + (end[i] - begin[i]) * (step / 100);
        if (!unit(pulled, 0, pulled, 0, 0.3)) return;
        turn.update(q, 0, dance, pulled, 0.999);
        rotate(got, 0, q, 0, dance, 0);
        // within a millionth of opposite they count as opposite
        expect(distanceBetween(got, 0, pulled, 0)).toBeLessThan(2e-6);
        // up to sign, of which there are two for a rotation
        const dot = before.reduce((sum, value, i) => sum + value * q[i], 0);
        if (step > 0) expect(Math.abs(dot)).toBeGreaterThan(0.97);
        before.set(q);
      }
      // when the limb is the dance's again it is the shortest, whatever the way
      turn.update(q, 0, dance, pulled, 0);
      const angle = 2 * Math.acos(Math.min(Math.abs(q[0]), 1));
      const apartBy = 2 * Math.asin(Math.min(distanceBetween(dance, 0, pulled, 0) / 2, 1));
      expect(angle).toBeCloseTo(apartBy, 5);
    }),
    { numRuns: 40 },
  );
});

test("joints are exactly either at both ends", () => {
  const one = Float64Array.from({ length: 12 }, (_, i) => Math.sin(i + 1)),
    other = one.map((value, i) => value + Math.cos(i));
  for (const joints of [one, other]) for (const at of [0, 4, 8]) normalise(joints, at);
  const out = new Float64Array(12),
    between = new JointBlend();
  between.blend(out, 0, one, 0, other, 0, 0);
  expect(out).toEqual(one);
  between.blend(out, 0, one, 0, other, 0, 1);
  expect(out).toEqual(other);
  between.blend(out, 0, one, 0, other, 0, 0.3);
  for (const at of [0, 4, 8]) expect(Math.hypot(...out.subarray(at, at + 4))).toBeCloseTo(1, 12);
});
