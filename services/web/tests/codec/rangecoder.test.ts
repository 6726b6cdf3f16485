import * as fc from "fast-check";
import { expect, test } from "vitest";
import { EVEN, RangeDecoder } from "../../src/codec/rangecoder";

/** The encoder of the contract, in whole numbers of any size: the stream is the lowest number of its last interval, as a fraction. */
function encode(bits: readonly { bit: number; probability: number }[]): Uint8Array {
  let low = 0n, range = 0xffffffffn, bytes = 4;
  for (const { bit, probability } of bits) {
    const bound = (range >> 15n) * BigInt(probability);
    if (bit) range = bound;
    else [low, range] = [low + bound, range - bound];
    for (; range < 1n << 24n; bytes++) [low, range] = [low << 8n, range << 8n];
  }
  const out = new Uint8Array(bytes);
  for (let at = bytes - 1; at >= 0; at--, low >>= 8n) out[at] = Number(low & 255n);
  let end = bytes;
  while (end > 0 && out[end - 1] === 0) end--;
  return out.subarray(0, end);
}

const probability = fc.oneof(fc.integer({ min: 64, max: 32704 }), fc.constantFrom(64, EVEN, 32704));
const bit = fc.record({ bit: fc.nat(1), probability });

test("reads what was written with the same probabilities", () => {
  fc.assert(
    fc.property(fc.array(bit, { maxLength: 400 }), fc.nat(5), (bits, start) => {
      const data = Uint8Array.of(...new Uint8Array(start).fill(7), ...encode(bits));
      const decoder = new RangeDecoder(data, start);
      for (const written of bits) expect(decoder.bit(written.probability)).toBe(written.bit);
    }),
  );
});

test("past the end come zeros, for ever", () => {
  const decoder = new RangeDecoder(new Uint8Array(0), 0);
  for (let i = 0; i < 10_000; i++) expect(decoder.bit(EVEN)).toBe(1);
});
