import fc from "fast-check";
import { expect, test } from "vitest";
import { separate } from "../../../src/stage/strings/separation";

test("what is apart already stays where it is", () => {
  expect(separate([3, 1, 2], 0.5)).toEqual([3, 1, 2]);
  expect(separate([], 1)).toEqual([]);
});

test("two that are too near go as far to either side", () => {
  const [a, b] = separate([0.1, 0], 0.4);
  expect(a).toBeCloseTo(0.25, 12);
  expect(b).toBeCloseTo(-0.15, 12);
});

test("all are apart, in their order, about the same middle", () => {
  const places = fc.array(fc.double({ min: -2, max: 2, noNaN: true }), { minLength: 1, maxLength: 4 });
  fc.assert(
    fc.property(places, (given) => {
      const found = separate(given, 0.3);
      const order = given.map((_, nth) => nth).sort((a, b) => given[a] - given[b]);
      order.slice(1).forEach((nth, rank) => expect(found[nth] - found[order[rank]]).toBeGreaterThan(0.3 - 1e-9));
      const sum = (numbers: number[]) => numbers.reduce((all, one) => all + one, 0);
      expect(sum(found)).toBeCloseTo(sum(given), 9);
    }),
  );
});
