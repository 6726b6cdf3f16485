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

/** The upper arm of a chord, below it in the plane that is turned by `turn` from some plane through it. */
function upperArm(chord: Float64Array, turn: number, lifted: number): Float64Array {
  const normal = new Float64Array(3),
    side = new Float64Array(3),
    out = new Float64Array(3);
  anyPerpendicular(normal, 0, chord, 0);
  cross(side, 0, chord, 0, normal, 0);
  combine(normal, 0, normal, 0, Math.cos(turn), side, 0, Math.sin(turn));
  cross(side, 0, chord, 0, normal, 0);
  combine(out, 0, chord, 0, Math.cos(lifted), side, 0, Math.sin(lifted));
  return out;
}

test("the right shoulder mirrors the left one", () => {
  fc.assert(
    fc.property(direction, (v) => {
      const mirrored = Float64Array.of(-v[0], v[1], v[2]);
      expect(right.depthInCaps(mirrored)).toBeCloseTo(left.depthInCaps(v), 12);
      expect(right.angleToAllowed(mirrored)).toBeCloseTo(left.angleToAllowed(v), 12);
    }),
  );
});

test("arms go forwards, down and to their side, not back and not across", () => {
  const goes = (x: number, y: number, z: number) => left.depthInCaps(Float64Array.of(x, y, z)) <= 0;
  expect([goes(0, 0, 1), goes(0, -1, 0), goes(1, 0, 0), goes(0, 1, 0)]).toEqual([true, true, true, true]);
  expect([goes(0, 0, -1), goes(-1, 0, 0)]).toEqual([false, false]);
});

test("the least turn about the chord brings the upper arm where a shoulder goes, if any does", () => {
  const normal = new Float64Array(3);
  let some = 0,
    none = 0;
  fc.assert(
    fc.property(direction, lift, (chord, lifted) => {
      anyPerpendicular(normal, 0, chord, 0);
      const turn = left.minAllowedTurn(chord, normal, lifted);
      const allowed = Array.from({ length: 360 }, (_, degrees) => ((degrees - 180) * Math.PI) / 180).filter(
        (angle) => left.depthInCaps(upperArm(chord, angle, lifted)) <= 0,
      );
      if (turn === null) {
        none++;
        expect(allowed).toEqual([]);
        return;
      }
      some++;
      expect(left.depthInCaps(upperArm(chord, turn, lifted))).toBeLessThan(1e-8);
      for (const angle of allowed) expect(Math.abs(turn)).toBeLessThanOrEqual(Math.abs(angle) + 1e-6);
    }),
    { numRuns: 300 },
  );
  expect(Math.min(some, none)).toBeGreaterThan(5);
});

test("it says how far away the nearest direction is that a shoulder has", () => {
  fc.assert(
    fc.property(direction, direction, (from, to) => {
      const away = left.angleToAllowed(from);
      if (left.depthInCaps(from) <= 0) expect(away).toBe(0);
      else if (left.depthInCaps(to) <= 0) expect(away).toBeLessThanOrEqual(angleBetween(from, to) + 1e-6);
    }),
    { numRuns: 500 },
  );
});

test("a way from where a shoulder goes never leads where none does, in steps no longer than said", () => {
  fc.assert(
    fc.property(direction, direction, fc.double({ min: 0.001, max: 0.1, noNaN: true }), (begin, end, most) => {
      fc.pre(left.depthInCaps(begin) <= 0 && left.depthInCaps(end) <= 0);
      const here = begin.slice(),
        before = begin.slice();
      for (let step = 0; step < 60; step++) {
        left.stepToward(here, here, end, most);
        expect(left.depthInCaps(here)).toBeLessThanOrEqual(1e-9);
        expect(angleBetween(here, before)).toBeLessThanOrEqual(1.01 * most);
        before.set(here);
      }
    }),
  );
});
