import { expect, test } from "vitest";
import { ancestorChain, commonAncestor, isDescendant } from "../../../src/avatar/naming/joint-tree";

const PARENTS = [-1, 0, 1, 1, 0, -1];

test("ancestors lead from a joint to the root", () => {
  expect(ancestorChain(PARENTS, 3)).toEqual([3, 1, 0]);
  expect(ancestorChain(PARENTS, -1)).toEqual([]);
});

test("a descendant is below a joint, at any depth, and not the joint itself", () => {
  expect([isDescendant(PARENTS, 3, 0), isDescendant(PARENTS, 3, 3), isDescendant(PARENTS, 4, 1)]).toEqual([
    true,
    false,
    false,
  ]);
});

test("the common ancestor is the lowest, and may be one of the joints", () => {
  expect(commonAncestor(PARENTS, [2, 3])).toBe(1);
  expect(commonAncestor(PARENTS, [2, 1])).toBe(1);
  expect(commonAncestor(PARENTS, [2, 3, 4])).toBe(0);
  expect(commonAncestor(PARENTS, [2, 5])).toBe(-1);
});
