import { expect, test } from "vitest";
import { fileName } from "../../src/export/file-name";

test.each([
  ["Sanbasō, First Steps", "Sanbasō, First Steps.bvh"],
  ["三番叟", "三番叟.bvh"],
  ["../../etc/passwd", "etc passwd.bvh"],
  ['a\\b:c*d?e"f<g>h|i', "a b c d e f g h i.bvh"],
  ["  .hidden. ", "hidden.bvh"],
  ["line\nbreak\u0000and \u202eturned", "line break and turned.bvh"],
  ["", "dance.bvh"],
  ["...", "dance.bvh"],
  ["CON", "dance CON.bvh"],
  ["\ud83d", "dance.bvh"],
])("%j becomes %j", (name, file) => expect(fileName(name, "bvh")).toBe(file));

test("long names are truncated between characters", () => {
  expect(fileName("🎭".repeat(200), "glb")).toBe(`${"🎭".repeat(80)}.glb`);
  expect(fileName("🎭".repeat(200), "bvh", ", Dancer 2")).toBe(`${"🎭".repeat(80)}, Dancer 2.bvh`);
});
