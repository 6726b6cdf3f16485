import * as fc from "fast-check";
import { expect, test } from "vitest";
import { HALF_PROBABILITY, RangeDecoder } from "../../src/codec/range-coder";
import { encodeBits } from "./range-encoder";

const probability = fc.oneof(fc.integer({ min: 1, max: 32767 }), fc.constantFrom(1, HALF_PROBABILITY, 32767));
const bit = fc.record({ bit: fc.nat(1), probability });

test("bits round-trip with the same probabilities", () => {
  fc.assert(
    fc.property(fc.array(bit, { maxLength: 400 }), (bits) => {
      const decoder = new RangeDecoder(encodeBits(bits));
      for (const { bit, probability } of bits) expect(decoder.decodeBit(probability)).toBe(bit);
    }),
  );
});

test("integers are decoded high bit first", () => {
  fc.assert(
    fc.property(fc.nat(2 ** 19 - 1), fc.nat(19), (value, bits) => {
      const truncated = value & (2 ** bits - 1);
      const encoded = Array.from({ length: bits }, (_, i) => ({
        bit: (truncated >> (bits - 1 - i)) & 1,
        probability: HALF_PROBABILITY,
      }));
      expect(new RangeDecoder(encodeBits(encoded)).decodeBits(bits)).toBe(truncated);
    }),
  );
});

test("data reads as zeros past its end", () => {
  const decoder = new RangeDecoder(new Uint8Array(0));
  for (let i = 0; i < 10_000; i++) expect(decoder.decodeBit(HALF_PROBABILITY)).toBe(1);
});
