import { expect, test } from "vitest";
import {
  isHand,
  limbNumber,
  limbWithinPerformer,
  MAX_LIMBS,
  MAX_PERFORMERS,
  performerOfLimb,
} from "../../src/wire/limbs";

test("limbs are numbered performer by performer", () => {
  expect([limbNumber(0, 3), limbNumber(1, 0), limbNumber(2, 1), limbNumber(3, 3)]).toEqual([3, 4, 9, 15]);
  expect([MAX_PERFORMERS, MAX_LIMBS]).toEqual([4, 16]);
  for (let number = 0; number < MAX_LIMBS; number++)
    expect(limbNumber(performerOfLimb(number), limbWithinPerformer(number))).toBe(number);
});

test("the first two limbs of a performer are hands", () => {
  expect([0, 1, 2, 3, 4, 5, 6, 7].filter(isHand)).toEqual([0, 1, 4, 5]);
});
