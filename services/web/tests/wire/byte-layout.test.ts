import { expect, test } from "vitest";
import { allocateMessage, dataViewOf, getU64, setU64 } from "../../src/wire/byte-layout";
import { MalformedMessage } from "../../src/wire/errors";

test("u64 fields are little-endian and read back unchanged", () => {
  const [bytes, view] = allocateMessage(9, 12);
  setU64(view, 2, 0x0006_5040_3020_10ff);
  expect([...bytes]).toEqual([9, 0, 0xff, 0x10, 0x20, 0x30, 0x40, 0x50, 0x06, 0, 0, 0]);
  expect(getU64(dataViewOf(bytes.subarray(2)), 0, "it")).toBe(0x0006_5040_3020_10ff);
});

test("u64 of 2^53 or more is refused with the name of its field", () => {
  const [bytes, view] = allocateMessage(0, 8);
  setU64(view, 0, Number.MAX_SAFE_INTEGER);
  expect(getU64(view, 0, "the time")).toBe(Number.MAX_SAFE_INTEGER);
  bytes.fill(255);
  expect(() => getU64(view, 0, "the time")).toThrow(MalformedMessage);
  expect(() => getU64(view, 0, "the time")).toThrow("the time is 2^53 or more");
});
