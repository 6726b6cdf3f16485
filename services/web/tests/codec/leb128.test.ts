import { expect, test } from "vitest";
import { DamagedBlock } from "../../src/codec/errors";
import { Leb128Reader } from "../../src/codec/leb128";

test("integers are read in order", () => {
  const reader = new Leb128Reader(Uint8Array.of(0, 127, 128, 1, 255, 255, 255, 127));
  expect([reader.read(), reader.read(), reader.read(), reader.read()]).toEqual([0, 127, 128, 2 ** 28 - 1]);
  expect(reader.offset).toBe(8);
});

test.each([[[]], [[128]], [[128, 128, 128]], [[128, 128, 128, 128, 1]]])("%j has no end", (bytes) => {
  expect(() => new Leb128Reader(Uint8Array.from(bytes)).read()).toThrow(DamagedBlock);
});
