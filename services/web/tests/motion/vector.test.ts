import fc from "fast-check";
import { expect, test } from "vitest";
import { conjugate, multiply, rotate } from "../../src/motion/rotation";
import {
  anyPerpendicular,
  cross,
  dot,
  fromColumns,
  fromCoordinateAxis,
  length,
  normalise,
  rejectFrom,
  rotationBetween,
  unit,
} from "../../src/motion/vector";

const part = fc.double({ min: -1, max: 1, noNaN: true });
const direction = fc
  .tuple(part, part, part)
  .filter((v) => Math.hypot(...v) > 0.05)
  .map((v) => Float64Array.from(v, (x) => x / Math.hypot(...v)));
const quaternion = fc
  .tuple(part, part, part, part)
  .filter((q) => Math.hypot(...q) > 0.05)
  .map((q) => Float64Array.from(q, (x) => x / Math.hypot(...q)));

test("rotationBetween takes one direction to the other, even opposite", () => {
  const q = new Float64Array(4),
    out = new Float64Array(3);
  fc.assert(
    fc.property(direction, direction, (a, b) => {
      rotationBetween(q, 0, a, 0, b, 0);
      rotate(out, 0, q, 0, a, 0);
      for (let i = 0; i < 3; i++) expect(Math.abs(out[i] - b[i])).toBeLessThan(1e-6);
      rotationBetween(
        q,
        0,
        a,
        0,
        a.map((x) => -x),
        0,
      );
      rotate(out, 0, q, 0, a, 0);
      for (let i = 0; i < 3; i++) expect(Math.abs(out[i] + a[i])).toBeLessThan(1e-6);
    }),
    // Almost opposite.
    {
      examples: [1.3e-6, 1.5e-7, 1.3e-7].map((angle) => [
        Float64Array.of(0, 1, 0),
        Float64Array.of(Math.sin(angle), -Math.cos(angle), 0),
      ]),
    },
  );
});

test("fromColumns recovers the rotation", () => {
  const columns = new Float64Array(9),
    again = new Float64Array(4);
  fc.assert(
    fc.property(quaternion, (q) => {
      for (let axis = 0; axis < 3; axis++) {
        const e = new Float64Array(3);
        e[axis] = 1;
        rotate(columns, 3 * axis, q, 0, e, 0);
      }
      fromColumns(again, 0, columns, 0);
      conjugate(again, 0, again, 0);
      multiply(again, 0, again, 0, q, 0);
      expect(Math.abs(again[0])).toBeGreaterThan(1 - 1e-12);
    }),
  );
});

test("rejectFrom and anyPerpendicular are perpendicular, unit is unit", () => {
  const out = new Float64Array(3);
  fc.assert(
    fc.property(direction, direction, (a, b) => {
      rejectFrom(out, 0, a, 0, b, 0);
      expect(Math.abs(dot(out, 0, b, 0))).toBeLessThan(1e-12);
      anyPerpendicular(out, 0, a, 0);
      expect(Math.abs(dot(out, 0, a, 0))).toBeLessThan(1e-12);
      expect(Math.abs(length(out, 0) - 1)).toBeLessThan(1e-12);
      cross(out, 0, a, 0, b, 0);
      expect(Math.abs(dot(out, 0, a, 0))).toBeLessThan(1e-12);
    }),
  );
  expect(unit(out, 0, new Float64Array(3), 0)).toBe(false);
});

test("normalised axis rotations rotate as expected", () => {
  const q = new Float64Array(4),
    out = new Float64Array(3);
  fromCoordinateAxis(q, 0, 2, Math.PI / 2);
  normalise(q, 0);
  rotate(out, 0, q, 0, Float64Array.of(1, 0, 0), 0);
  expect(out[1]).toBeCloseTo(1, 12);
});
