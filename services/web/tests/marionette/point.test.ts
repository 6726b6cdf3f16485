import { expect, test } from "vitest";
import { anyPerpendicularTo, dotOf, lengthOf, ORIGIN, rejected, rotated, unitOr } from "../../src/marionette/point";

test("a vector without length has the fallback's direction", () => {
  expect(unitOr([0, 3, 4], ORIGIN)).toEqual([0, expect.closeTo(0.6), 0.8]);
  expect(unitOr([1e-13, 0, 0], [0, 1, 0])).toEqual([0, 1, 0]);
});

test("a rejected and a perpendicular vector are at right angles to the axis", () => {
  for (const axis of [
    [1, 0, 0],
    [0, 0.6, 0.8],
  ] as const) {
    expect(dotOf(rejected([0.3, 0.4, 0.5], axis), axis)).toBeCloseTo(0, 12);
    expect(dotOf(anyPerpendicularTo(axis), axis)).toBeCloseTo(0, 12);
    expect(lengthOf(anyPerpendicularTo(axis))).toBeCloseTo(1, 12);
  }
});

test("a half turn about y reverses x and z", () => {
  expect(rotated(Float64Array.of(0, 0, 1, 0), [1, 2, 3])).toEqual([-1, 2, -3]);
});
