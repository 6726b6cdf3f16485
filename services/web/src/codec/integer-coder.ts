/** Adaptive coder of a few integers (`proto/codec.md`, 2.4): lengths and references of skeletons and extensions. */

import { DamagedBlock } from "./errors";
import { HALF_PROBABILITY, RangeDecoder } from "./range-coder";

/** The bit length of a coded magnitude plus one, minus one, is below this. */
const INTEGER_BITS_LIMIT = 17;
/** Initial probability of one more bit: 0.7, in 1/32768. */
const INITIAL_LENGTH_PROBABILITY = 22938;

/**
 * Decodes integers. Each is its magnitude plus one, the bit length minus one in unary with the
 * adaptive models of its group, then the low bits, then the sign. A mirrored one is the difference of its magnitude
 * from that of the earlier integer, coded alike, then whether the signs differ.
 *
 * @param modelGroups group of models of each integer
 * @param mirrorOf index of the earlier integer that each integer mirrors, or -1
 * @throws DamagedBlock
 */
export function decodeIntegers(
  data: Uint8Array,
  modelGroups: readonly number[],
  mirrorOf: readonly number[],
): Float64Array {
  const decoder = new RangeDecoder(data);
  const groups = Math.max(...modelGroups) + 1;
  const lengths = new Int32Array(groups * INTEGER_BITS_LIMIT).fill(INITIAL_LENGTH_PROBABILITY),
    signs = new Int32Array(groups).fill(HALF_PROBABILITY);
  const decodeAdaptive = (model: Int32Array, index: number): 0 | 1 => {
    const bit = decoder.decodeBit(model[index]);
    model[index] = Math.min(Math.max(model[index] + (((bit ? 32768 : 0) - model[index]) >> 3), 1024), 31744);
    return bit;
  };
  const values = new Float64Array(modelGroups.length);
  modelGroups.forEach((group, i) => {
    let length = 0;
    while (length < INTEGER_BITS_LIMIT && decodeAdaptive(lengths, group * INTEGER_BITS_LIMIT + length)) length++;
    if (length === INTEGER_BITS_LIMIT)
      throw new DamagedBlock(`Invalid description: an integer has ${INTEGER_BITS_LIMIT} or more bits.`);
    let magnitude = ((1 << length) | decoder.decodeBits(length)) - 1;
    let negative = magnitude > 0 && decoder.decodeBit(HALF_PROBABILITY) === 1;
    if (mirrorOf[i] >= 0) {
      const mirrored = values[mirrorOf[i]];
      magnitude = Math.abs(mirrored) + (negative ? -magnitude : magnitude);
      if (magnitude < 0) throw new DamagedBlock("Invalid description: an integer has a negative magnitude.");
      negative = magnitude > 0 && (decodeAdaptive(signs, group) === 1) !== mirrored < 0;
    }
    values[i] = negative ? -magnitude : magnitude;
  });
  return values;
}
