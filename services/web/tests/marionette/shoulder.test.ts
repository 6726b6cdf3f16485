import * as fc from "fast-check";
import { expect, test } from "vitest";
import { angleBetween } from "../../src/marionette/elbow";
import { ShoulderLimit } from "../../src/marionette/shoulder";
import { anyPerpendicular, combine, cross, unit } from "../../src/motion/vector";

const part = fc.double({ min: -1, max: 1, noNaN: true });
const direction = fc
  .tuple(part, part, part)
  .map((parts) => Float64Array.from(parts))
  .filter((v) => unit(v, 0, v, 0, 0.1));
const lift = fc.double({ min: 0.01, max: 1.5, noNaN: true });
const left = new ShoulderLimit(false),
  right = new ShoulderLimit(true);

/** Return the direction of the upper arm: `liftAngle` below the chord, in a plane turned about the chord by `turn`. */
function upperArm(chord: Float64Array, turn: number, liftAngle: number): Float64Array {
  const normal = new Float64Array(3),
    side = new Float64Array(3),
    out = new Float64Array(3);
  anyPerpendicular(normal, 0, chord, 0);
  cross(side, 0, chord, 0, normal, 0);
  combine(normal, 0, normal, 0, Math.cos(turn), side, 0, Math.sin(turn));
  cross(side, 0, chord, 0, normal, 0);
  combine(out, 0, chord, 0, Math.cos(liftAngle), side, 0, Math.sin(liftAngle));
  return out;
}

test("right shoulder mirrors the left one", () => {
  fc.assert(
    fc.property(direction, (v) => {
      const mirrored = Float64Array.of(-v[0], v[1], v[2]);
      expect(right.depthInCaps(mirrored)).toBeCloseTo(left.depthInCaps(v), 12);
      expect(right.angleToAllowed(mirrored)).toBeCloseTo(left.angleToAllowed(v), 12);
    }),
  );
});

test("forwards, down and sideways are allowed, back and across are not", () => {
  const isAllowed = (x: number, y: number, z: number) => left.depthInCaps(Float64Array.of(x, y, z)) <= 0;
  expect([isAllowed(0, 0, 1), isAllowed(0, -1, 0), isAllowed(1, 0, 0), isAllowed(0, 1, 0)]).toEqual([
    true,
    true,
    true,
    true,
  ]);
  expect([isAllowed(0, 0, -1), isAllowed(-1, 0, 0)]).toEqual([false, false]);
});

test("minAllowedTurn is allowed and minimal, or null", () => {
  const normal = new Float64Array(3);
  let allowedCount = 0,
    forbiddenCount = 0;
  fc.assert(
    fc.property(direction, lift, (chord, liftAngle) => {
      anyPerpendicular(normal, 0, chord, 0);
      const turn = left.minAllowedTurn(chord, normal, liftAngle);
      const allowed = Array.from({ length: 360 }, (_, degrees) => ((degrees - 180) * Math.PI) / 180).filter(
        (angle) => left.depthInCaps(upperArm(chord, angle, liftAngle)) <= 0,
      );
      if (turn === null) {
        forbiddenCount++;
        expect(allowed).toEqual([]);
        return;
      }
      allowedCount++;
      expect(left.depthInCaps(upperArm(chord, turn, liftAngle))).toBeLessThan(1e-8);
      for (const angle of allowed) expect(Math.abs(turn)).toBeLessThanOrEqual(Math.abs(angle) + 1e-6);
    }),
    { numRuns: 300 },
  );
  expect(Math.min(allowedCount, forbiddenCount)).toBeGreaterThan(5);
});

test("angleToAllowed is the angle to the nearest allowed direction", () => {
  fc.assert(
    fc.property(direction, direction, (from, to) => {
      const distance = left.angleToAllowed(from);
      if (left.depthInCaps(from) <= 0) expect(distance).toBe(0);
      else if (left.depthInCaps(to) <= 0) expect(distance).toBeLessThanOrEqual(angleBetween(from, to) + 1e-6);
    }),
    { numRuns: 500 },
  );
});

test("stepToward stays within the limit and the maximum step", () => {
  fc.assert(
    fc.property(direction, direction, fc.double({ min: 0.001, max: 0.1, noNaN: true }), (begin, end, maxAngle) => {
      fc.pre(left.depthInCaps(begin) <= 0 && left.depthInCaps(end) <= 0);
      const current = begin.slice(),
        before = begin.slice();
      for (let step = 0; step < 60; step++) {
        left.stepToward(current, current, end, maxAngle);
        expect(left.depthInCaps(current)).toBeLessThanOrEqual(1e-9);
        expect(angleBetween(current, before)).toBeLessThanOrEqual(1.01 * maxAngle);
        before.set(current);
      }
    }),
  );
});
