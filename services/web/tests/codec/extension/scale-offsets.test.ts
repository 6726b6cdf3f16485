import { expect, test } from "vitest";
import { DamagedBlock } from "../../../src/codec/errors";
import { toScales } from "../../../src/codec/extension/scale-offsets";

test("offsets fill whole channels", () => {
  expect([...toScales([1, -2, 0, 7], 2)]).toEqual([128, -256, 0, 896, 0, 0]);
});

test.each([-9, 8])("offset %i is refused", (offset) => {
  expect(() => toScales([0, offset], 1)).toThrow(DamagedBlock);
});
