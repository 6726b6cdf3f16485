/**
 * Binary range decoder in 32-bit integers (Martin 1979; the carry as in LZMA; `proto/codec.md`, 2.1). It decodes
 * the same bits as `codec/_kernels/range_coder.py`.
 */

const RENORMALISATION_LIMIT = 2 ** 24;

/** Probability of one half, in 1/32768. */
export const HALF_PROBABILITY = 16384;

/** Decoder of one block. */
export class RangeDecoder {
  private readonly data: Uint8Array;
  private position = 0;
  private low = 0;
  private range = 0xffffffff;

  /** The encoder's first byte, always zero, is not in `data`. Past its end, `data` reads as zeros. */
  constructor(data: Uint8Array) {
    this.data = data;
    for (let i = 0; i < 4; i++) this.low = ((this.low << 8) | this.nextByte()) >>> 0;
  }

  /** Returns the next bit. `probability` is that of a 1, in 1/32768, as it was when the bit was written. */
  decodeBit(probability: number): 0 | 1 {
    // at most 2^17 x 2^15: exact in a double
    const bound = (this.range >>> 15) * probability;
    const one = this.low < bound;
    if (one) {
      this.range = bound;
    } else {
      this.low -= bound;
      this.range -= bound;
    }
    while (this.range < RENORMALISATION_LIMIT) {
      this.low = ((this.low << 8) | this.nextByte()) >>> 0;
      this.range = (this.range << 8) >>> 0;
    }
    return one ? 1 : 0;
  }

  /** Returns an integer of `bits` equiprobable bits, high bit first, below 2^31. */
  decodeBits(bits: number): number {
    let value = 0;
    for (let i = 0; i < bits; i++) value = (value << 1) | this.decodeBit(HALF_PROBABILITY);
    return value;
  }

  private nextByte(): number {
    return this.position < this.data.length ? this.data[this.position++] : 0;
  }
}
