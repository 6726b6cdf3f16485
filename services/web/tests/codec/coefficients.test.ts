import { expect, test } from "vitest";
import { decodeCoefficients } from "../../src/codec/coefficients";
import { DamagedBlock } from "../../src/codec/errors";
import { type BlockVectors } from "../golden";
import { bytes, vectors } from "../vectors";

const golden = vectors<BlockVectors>("blocks").valid;

test("the golden coefficients, and how many frequencies they have", () => {
  for (const vector of golden) {
    const { count, q } = decodeCoefficients(bytes(vector.block), 7, vector.frames);
    expect(count * 57).toBe(vector.q.length);
    expect([...q]).toEqual(vector.q);
  }
});

test("no bytes say the most frequencies there are, which fits no block", () => {
  expect(() => decodeCoefficients(new Uint8Array(0), 0, 1000)).toThrow("1023 frequencies for 1000 frames");
});

test("more frequencies than frames, and an escape without end, are refused", () => {
  const { block, q } = golden[0];
  expect(() => decodeCoefficients(bytes(block), 7, q.length / 57 - 1)).toThrow(DamagedBlock);
  // frequencies: one; then the lowest number of every interval: ones only
  expect(() => decodeCoefficients(Uint8Array.of(255, 128), 0, 1000)).toThrow("longer than 24 bits");
});
