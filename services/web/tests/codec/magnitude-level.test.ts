import { expect, test } from "vitest";
import { magnitudeLevel, magnitudeLevels } from "../../src/codec/magnitude-level";

test("level L is the largest with 2 L at most the bits of (magnitude + 1)^32", () => {
  const table = magnitudeLevels();
  expect(table.length).toBe(4096);
  for (let magnitude = 0; magnitude < 4096; magnitude++) {
    const power = BigInt(magnitude + 1) ** 32n,
      twice = 2n * BigInt(table[magnitude]);
    // a number has at least n bits if it is at least 2^(n - 1)
    expect(twice === 0n || power >= 1n << (twice - 1n)).toBe(true);
    expect(power < 1n << (twice + 1n)).toBe(true);
  }
});

test("level is 16 log2(1 + magnitude), rounded", () => {
  for (const magnitude of [0, 1, 2, 3, 7, 100, 4095])
    expect(magnitudeLevel(magnitude)).toBe(Math.round(16 * Math.log2(1 + magnitude)));
});

test("magnitudes above 4095 have the level of 4095", () => {
  expect([magnitudeLevel(4095), magnitudeLevel(4096), magnitudeLevel(2 ** 40)]).toEqual([192, 192, 192]);
});
