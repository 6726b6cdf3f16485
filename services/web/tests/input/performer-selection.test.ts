import { beforeEach, expect, test } from "vitest";
import { PerformerSelection } from "../../src/input/performer-selection";

let told: number;
let chosen: PerformerSelection;

beforeEach(() => {
  told = 0;
  chosen = new PerformerSelection(() => told++);
});

test("is the first of one; limbs go by their names", () => {
  expect([chosen.performer, chosen.count, chosen.limb(3)]).toEqual([0, 1, 3]);
  chosen.select(1);
  expect([chosen.performer, told]).toEqual([0, 0]);
});

test("another's limbs are numbered on; the same choice again is no news", () => {
  chosen.count = 3;
  chosen.select(2);
  chosen.select(2);
  expect([chosen.performer, chosen.limb(0), chosen.limb(3), told]).toEqual([2, 8, 11, 2]);
});

test("stays while there are as many, and is the first again where the chosen one goes", () => {
  chosen.count = 4;
  chosen.select(1);
  chosen.count = 2;
  expect(chosen.performer).toBe(1);
  chosen.count = 1;
  expect(chosen.performer).toBe(0);
});
