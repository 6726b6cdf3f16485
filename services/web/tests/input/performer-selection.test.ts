import { beforeEach, expect, test } from "vitest";
import { PerformerSelection } from "../../src/input/performer-selection";

let changes: number;
let selection: PerformerSelection;

beforeEach(() => {
  changes = 0;
  selection = new PerformerSelection(() => changes++);
});

test("selects the first of one performer by default", () => {
  expect([selection.performer, selection.count, selection.limb(3)]).toEqual([0, 1, 3]);
  selection.select(1);
  expect([selection.performer, changes]).toEqual([0, 0]);
});

test("numbers the limbs of other performers, and reports changes once", () => {
  selection.count = 3;
  selection.select(2);
  selection.select(2);
  expect([selection.performer, selection.limb(0), selection.limb(3), changes]).toEqual([2, 8, 11, 2]);
});

test("keeps the selection while possible, then returns to the first", () => {
  selection.count = 4;
  selection.select(1);
  selection.count = 2;
  expect(selection.performer).toBe(1);
  selection.count = 1;
  expect(selection.performer).toBe(0);
});
