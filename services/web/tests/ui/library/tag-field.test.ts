import { expect, test } from "vitest";
import { addTags } from "../../../src/ui/library/tag-field";

test("tags are divided by commas of any script, trimmed, and unique whatever their case", () => {
  expect(addTags(["Fan"], " fan, slow、 雪 ，night walk,,slow ")).toEqual(["Fan", "slow", "雪", "night walk"]);
  expect(addTags(["a"], "  ")).toEqual(["a"]);
});

test("a motion has at most sixteen tags of forty characters", () => {
  const many = Array.from({ length: 20 }, (_, index) => `t${index}`);
  expect(addTags([], many.join(","))).toEqual(many.slice(0, 16));
  expect(addTags([], "x".repeat(60))).toEqual(["x".repeat(40)]);
});
