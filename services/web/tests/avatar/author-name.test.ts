import { expect, test } from "vitest";
import { cleanName, nameOfFile } from "../../src/avatar/author-name";

test.each([
  ["Sato", "Sato"],
  [" Sato\tHanako ", "Sato Hanako"],
  ["\u202eSato\u0000", "Sato"],
  ["\u4f50\u85e4 \u2605", "\u4f50\u85e4 \u2605"],
  ["Undefined", null],
  ["NULL", null],
  ["  ", null],
  ["\u200b\u0007", null],
  ["", null],
  [null, null],
])("%j is shown as %j", (name, shown) => {
  expect(cleanName(name)).toBe(shown);
});

test("a name is shortened", () => {
  expect(cleanName("x".repeat(1000))).toHaveLength(80);
});

test("a file's name loses its extension", () => {
  expect(["mine.glb", "my.body.vrm", ".vrm", "mine"].map(nameOfFile)).toEqual(["mine", "my.body", ".vrm", "mine"]);
});
