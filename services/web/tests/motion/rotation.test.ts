import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import {
  conjugate,
  fromRotationVector,
  multiply,
  rotate,
  slerp,
  toMatrix,
  toRotationVector,
} from "../../src/motion/rotation";

const part = fc.double({ min: -4, max: 4, noNaN: true });
const vector = fc.tuple(part, part, part);
const turn = vector.map((v) => {
  const q = new Float64Array(4);
  fromRotationVector(q, 0, ...v);
  return q;
});

function expectNear(actual: ArrayLike<number>, expected: ArrayLike<number>, tolerance = 1e-12): void {
  for (let i = 0; i < expected.length; i++) expect(Math.abs(actual[i] - expected[i])).toBeLessThan(tolerance);
}

/** Expect two quaternions to be the same rotation: their signs may differ. */
function expectSameRotation(a: Float64Array, b: Float64Array, tolerance = 1e-9): void {
  expect(1 - Math.abs(a.reduce((sum, value, i) => sum + value * b[i], 0))).toBeLessThan(tolerance);
}

test("a quarter turn about y takes z to x", () => {
  const q = new Float64Array(4),
    out = new Float64Array(3);
  fromRotationVector(q, 0, 0, Math.PI / 2, 0);
  rotate(out, 0, q, 0, Float64Array.of(0, 0, 1), 0);
  expectNear(out, [1, 0, 0]);
});

test("multiply applies the second, then the first, also in place", () => {
  fc.assert(
    fc.property(turn, turn, vector, (a, b, v) => {
      const both = a.slice(),
        one = new Float64Array(3),
        two = Float64Array.from(v);
      multiply(both, 0, both, 0, b, 0);
      rotate(one, 0, both, 0, two, 0);
      rotate(two, 0, b, 0, two, 0);
      rotate(two, 0, a, 0, two, 0);
      expectNear(one, two, 1e-11);
    }),
  );
});

test("a rotation and its conjugate cancel", () => {
  fc.assert(
    fc.property(turn, (q) => {
      const back = new Float64Array(4);
      conjugate(back, 0, q, 0);
      multiply(back, 0, back, 0, q, 0);
      expectNear(back, [1, 0, 0, 0]);
    }),
  );
});

test("a matrix rotates like its quaternion", () => {
  fc.assert(
    fc.property(turn, vector, (q, v) => {
      const m = new Float64Array(9),
        turned = new Float64Array(3);
      toMatrix(m, 0, q, 0);
      rotate(turned, 0, q, 0, Float64Array.from(v), 0);
      expectNear(
        [0, 3, 6].map((row) => m[row] * v[0] + m[row + 1] * v[1] + m[row + 2] * v[2]),
        turned,
        1e-11,
      );
    }),
  );
});

test("rotation vectors are the shortest of their rotation", () => {
  fc.assert(
    fc.property(turn, (q) => {
      const v = new Float64Array(3),
        again = new Float64Array(4);
      toRotationVector(v, 0, q, 0);
      expect(Math.hypot(...v)).toBeLessThanOrEqual(Math.PI + 1e-12);
      fromRotationVector(again, 0, v[0], v[1], v[2]);
      expectSameRotation(again, q);
    }),
  );
});

test("tiny rotation vectors keep their precision", () => {
  const q = new Float64Array(4),
    v = new Float64Array(3);
  for (const x of [0, 1e-200, 1e-12, 9.9e-5, 1.01e-4]) {
    fromRotationVector(q, 0, x, 0, -x);
    expectNear([q[1]], [Math.sin(x * Math.SQRT1_2) * Math.SQRT1_2], 1e-16 + x * 1e-12);
    toRotationVector(v, 0, q, 0);
    expectNear(v, [x, 0, -x], 1e-16 + x * 1e-9);
  }
});

describe("slerp", () => {
  test("starts and ends at its arguments, with unit length between", () => {
    fc.assert(
      fc.property(turn, turn, fc.double({ min: 0, max: 1, noNaN: true }), (a, b, t) => {
        const out = new Float64Array(4);
        slerp(out, 0, a, 0, b, 0, 0);
        expectSameRotation(out, a);
        slerp(out, 0, a, 0, b, 0, 1);
        expectSameRotation(out, b);
        slerp(out, 0, a, 0, b, 0, t);
        expect(Math.hypot(...out)).toBeCloseTo(1, 9);
      }),
    );
  });

  test("has constant speed by the shorter way", () => {
    const a = Float64Array.of(1, 0, 0, 0),
      b = new Float64Array(4),
      out = new Float64Array(4),
      v = new Float64Array(3);
    fromRotationVector(b, 0, 0, 0, 2);
    for (const sign of [1, -1]) {
      slerp(
        out,
        0,
        a,
        0,
        b.map((value) => sign * value),
        0,
        0.25,
      );
      toRotationVector(v, 0, out, 0);
      expectNear(v, [0, 0, 0.5]);
    }
  });
});
