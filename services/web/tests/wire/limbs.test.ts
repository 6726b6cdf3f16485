import { expect, test } from "vitest";
import { limbNumber, limbOf, MOST_LIMBS, MOST_PERFORMERS, performerOf } from "../../src/wire/limbs";

test("limbs are numbered performer by performer, and each number names one", () => {
  expect([limbNumber(0, 3), limbNumber(1, 0), limbNumber(2, 1), limbNumber(3, 3)]).toEqual([3, 4, 9, 15]);
  expect([MOST_PERFORMERS, MOST_LIMBS]).toEqual([4, 16]);
  for (let number = 0; number < MOST_LIMBS; number++) expect(limbNumber(performerOf(number), limbOf(number))).toBe(number);
});
