import { expect, test } from "vitest";
import { magnitudeLevel, magnitudeLevels } from "../../src/codec/magnitude-level";

test("every level is the largest L whose 2 L is no more than the bits of (size + 1)^32", () => {
  const table = magnitudeLevels();
  expect(table.length).toBe(4096);
  for (let size = 0; size < 4096; size++) {
    const power = BigInt(size + 1) ** 32n,
      twice = 2n * BigInt(table[size]);
    // a number has at least n bits where it is 2^(n - 1) or more
    expect(twice === 0n || power >= 1n << (twice - 1n)).toBe(true);
    expect(power < 1n << (twice + 1n)).toBe(true);
  }
});

test("16 log2 to the nearest", () => {
  for (const size of [0, 1, 2, 3, 7, 100, 4095])
    expect(magnitudeLevel(size)).toBe(Math.round(16 * Math.log2(1 + size)));
});

test("sizes past the table have its last level", () => {
  expect([magnitudeLevel(4095), magnitudeLevel(4096), magnitudeLevel(2 ** 40)]).toEqual([192, 192, 192]);
});
