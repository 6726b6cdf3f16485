/**
 * Bytes to the quantised coefficients of one block: contexts, adaptive models, range decoder (`proto/SPEC.md`, Motion block: Order,
 * Symbol, Exp-Golomb, Model).
 */

import { CHANNEL_COUNT } from "../motion/skeleton";
import { DamagedBlock } from "./errors";
import { EVEN, RangeDecoder } from "./rangecoder";

const FREQUENCY_BITS = 10;
const UNARY = 14;
const ESCAPE = 24;

// all models lie in one array: unary [class 3][position 4][neighbourhood 6][14], then Exp-Golomb [class 3][2][24]
const UNARY_MODELS = 3 * 4 * 6 * UNARY;
const MODELS = UNARY_MODELS + 3 * 2 * ESCAPE;
const ESCAPE_START = 26214;
const FRESH = Uint16Array.from({ length: MODELS }, (_, i) =>
  i < UNARY_MODELS ? [4274, 10923, 16384, 21845, 26214, 29789][Math.floor(i / UNARY) % 6] : ESCAPE_START,
);

/** A bit's shift depends on how many its model has seen, up to this many. */
const SEEN = 6;

class Models {
  private readonly probability = FRESH.slice();
  private readonly seen = new Uint8Array(MODELS);

  constructor(private readonly decoder: RangeDecoder) {}

  /** The next bit by model `which`, which learns from it. */
  bit(which: number): 0 | 1 {
    const probability = this.probability[which];
    const bit = this.decoder.bit(probability);
    const seen = this.seen[which];
    const moved = probability + (((bit ? 32768 : 0) - probability) >> (2 + (seen >> 1)));
    this.probability[which] = moved < 64 ? 64 : moved > 32704 ? 32704 : moved;
    if (seen < SEEN) this.seen[which] = seen + 1;
    return bit;
  }

  /** Exp-Golomb with the models from `first`. */
  golomb(first: number): number {
    let length = 0;
    while (length < ESCAPE && this.bit(first + length)) length++;
    if (length === ESCAPE) throw new DamagedBlock("block holds a number longer than 24 bits");
    let value = 1;
    for (let i = 0; i < length; i++) value = (value << 1) | this.decoder.bit(EVEN);
    return value - 1;
  }

  /** The size of a coefficient by the unary models from `first`, and the Exp-Golomb models from `escape` where it is large. */
  size(first: number, escape: number): number {
    let value = 0;
    while (value < UNARY && this.bit(first + value)) value++;
    return value === UNARY ? UNARY + this.golomb(escape) : value;
  }
}

/** Quantised coefficients: `q` is [channel 19][axis 3][frequency `count`]. */
export interface Coefficients {
  count: number;
  q: Int32Array;
}

/**
 * The coefficients of a block of `frames` frames, range-coded from byte `start` of `data` on. The work is bounded by 57 x
 * `frames` coefficients of at most 62 bits.
 *
 * @throws DamagedBlock
 */
export function decodeCoefficients(data: Uint8Array, start: number, frames: number): Coefficients {
  const decoder = new RangeDecoder(data, start);
  let count = 0;
  for (let i = 0; i < FREQUENCY_BITS; i++) count = (count << 1) | decoder.bit(EVEN);
  if (count > frames) throw new DamagedBlock(`block says ${count} frequencies for ${frames} frames`);
  const q = new Int32Array(CHANNEL_COUNT * 3 * count);
  const models = new Models(decoder);
  // sizes of this axis and of the one before, in the same channel
  let sizes = new Float64Array(count);
  let before = new Float64Array(count);
  for (let track = 0, at = 0; track < CHANNEL_COUNT * 3; track++) {
    const channelClass = Math.min(Math.floor(track / 3), 2);
    const golomb = UNARY_MODELS + channelClass * 2 * ESCAPE;
    const firstAxis = track % 3 === 0;
    for (let k = 0; k < count; k++, at++) {
      let value: number;
      if (k === 0) {
        value = models.golomb(golomb);
      } else {
        const near = 2 * sizes[k - 1] + (k > 1 ? sizes[k - 2] : 0) + (firstAxis ? 0 : before[k]);
        const neighbourhood = near < 1 ? 0 : near < 3 ? 1 : near < 5 ? 2 : near < 9 ? 3 : near < 17 ? 4 : 5;
        const position = k === 1 ? 0 : k < 4 ? 1 : k < 8 ? 2 : 3;
        value = models.size(((channelClass * 4 + position) * 6 + neighbourhood) * UNARY, golomb + ESCAPE);
      }
      sizes[k] = value;
      q[at] = value > 0 && decoder.bit(EVEN) ? -value : value;
    }
    [sizes, before] = [before, sizes];
  }
  return { count, q };
}
