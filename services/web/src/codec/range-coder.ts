/**
 * The binary range decoder of `proto/SPEC.md`, Range coder: integers of 32 bits only (Martin 1979; the carry as in LZMA), so
 * that it reaches the same bits as the Python room `codec/rangecoder.py`.
 */

const TOP = 2 ** 24;

/** Probability of one half, in 1/32768. */
export const HALF_PROBABILITY = 16384;

export class RangeDecoder {
  private readonly data: Uint8Array;
  private position = 0;
  private low = 0;
  private range = 0xffffffff;

  /** Starts at the first byte of `data`; the coder's own first byte, always zero, was not sent. Past the end come zeros. */
  constructor(data: Uint8Array) {
    this.data = data;
    for (let i = 0; i < 4; i++) this.low = ((this.low << 8) | this.nextByte()) >>> 0;
  }

  /** The next bit, a 1 having had `probability` / 32768 when it was written. */
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
    while (this.range < TOP) {
      this.low = ((this.low << 8) | this.nextByte()) >>> 0;
      this.range = (this.range << 8) >>> 0;
    }
    return one ? 1 : 0;
  }

  /** The next `bits` equiprobable bits, high first: a number below 2^31. */
  decodeBits(bits: number): number {
    let value = 0;
    for (let i = 0; i < bits; i++) value = (value << 1) | this.decodeBit(HALF_PROBABILITY);
    return value;
  }

  private nextByte(): number {
    return this.position < this.data.length ? this.data[this.position++] : 0;
  }
}
