import fc from "fast-check";
import { expect, test } from "vitest";
import { limit, separate } from "../../../src/stage/strings/separation";

test("separate positions do not move", () => {
  expect(separate([3, 1, 2], 0.5)).toEqual([3, 1, 2]);
  expect(separate([], 1)).toEqual([]);
});

test("two close positions move apart by the same distance", () => {
  const [a, b] = separate([0.1, 0], 0.4);
  expect(a).toBeCloseTo(0.25, 12);
  expect(b).toBeCloseTo(-0.15, 12);
});

test("all positions are separated, in order, around the same mean", () => {
  const places = fc.array(fc.double({ min: -2, max: 2, noNaN: true }), { minLength: 1, maxLength: 4 });
  fc.assert(
    fc.property(places, (given) => {
      const separated = separate(given, 0.3);
      const order = given.map((_, index) => index).sort((a, b) => given[a] - given[b]);
      order
        .slice(1)
        .forEach((index, rank) => expect(separated[index] - separated[order[rank]]).toBeGreaterThan(0.3 - 1e-9));
      const sum = (numbers: number[]) => numbers.reduce((all, value) => all + value, 0);
      expect(sum(separated)).toBeCloseTo(sum(given), 9);
    }),
  );
});

test("limited positions move inside with their distances, in their order", () => {
  expect(limit([0, 1, 5], 1, [-2, 6])).toEqual([0, 1, 5]);
  expect(limit([5, 0, 6], 1, [-2, 4])).toEqual([3, 0, 4]);
  expect(limit([-4, -3, 0], 1, [-2, 4])).toEqual([-2, -1, 0]);
  expect(limit([0, 1, 2], 1, [0, 1])).toEqual([0, 1, 2]);
});
