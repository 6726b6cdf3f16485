/**
 * Decoder of block bytes: header and quantised coefficients (`proto/codec.md`, 2.8 and 2.9). It decodes the same bits
 * as `codec/_kernels/entropy_coder.py`.
 */

import { type ChannelLayout, MOTION_LAYOUT } from "./channel-layout";
import { ContextModel, FREQUENCY_CLASS_OF, signContext } from "./context-model";
import { DamagedBlock } from "./errors";
import { magnitudeLevel } from "./magnitude-level";
import { HAZARD_ROWS, HAZARD_TABLE_OF, type Prior, SIGN_CONTEXTS, UNARY_DECISIONS } from "./prior";
import { HALF_PROBABILITY, RangeDecoder } from "./range-coder";
import { MAX_BLOCK_FRAMES } from "./timing";

/** Limit of the bytes of a block. */
export const MAX_BLOCK_BYTES = 65_536;

const NOMINAL_FRAMES_PROBABILITY = 32440;
const ROOT_ONLY_PROBABILITY = 512;
const MAX_ESCAPE_BITS = 20;

/** Offset of the hazard table of each frequency. */
const HAZARD_OFFSET_OF = Uint16Array.from(
  FREQUENCY_CLASS_OF,
  (frequencyClass) => HAZARD_TABLE_OF[frequencyClass] * HAZARD_ROWS * UNARY_DECISIONS,
);

/** Header and quantised coefficients of a block. */
export interface BlockCoefficients {
  frames: number;
  /** Step index, 0..255. */
  step: number;
  /**
   * Rotation about y, in 1/64 of a turn, that the root's rotations are relative to, -32..31; 0 in other layouts than a
   * motion's.
   */
  heading: number;
  /** Frequencies of each axis. */
  count: number;
  /** Integers [channel][axis 3][`count`]; the largest possible magnitude is slightly above 2^31. */
  q: Float64Array;
}

/** Returns the level of a block's duration in sixteenths of a second, a feature of the context model. */
export function durationLevel(frames: number, fps: number): number {
  return magnitudeLevel(Math.floor((16 * frames) / fps + 0.5));
}

/**
 * Decodes one block. The work is bounded by 29,184 coefficients of at most 70 bits.
 *
 * @param nominalFrames the track's `blockFrames`
 * @param layout channels of the block
 * @throws DamagedBlock
 */
export function decodeCoefficients(
  prior: Prior,
  data: Uint8Array,
  nominalFrames: number,
  fps: number,
  layout: ChannelLayout = MOTION_LAYOUT,
): BlockCoefficients {
  if (data.length > MAX_BLOCK_BYTES) {
    throw new DamagedBlock(`Invalid block: ${data.length} bytes, at most ${MAX_BLOCK_BYTES} are allowed.`);
  }
  const decoder = new RangeDecoder(data);
  const frames = decoder.decodeBit(NOMINAL_FRAMES_PROBABILITY) ? nominalFrames : decoder.decodeBits(10);
  if (frames < 1 || frames > MAX_BLOCK_FRAMES) {
    throw new DamagedBlock(`Invalid block: ${frames} frames, expected 1..${MAX_BLOCK_FRAMES}.`);
  }
  const channels = layout.heading && decoder.decodeBit(ROOT_ONLY_PROBABILITY) ? 2 : layout.count;
  const step = decoder.decodeBits(8);
  const heading = layout.heading ? decoder.decodeBits(6) - 32 : 0;
  const count = decoder.decodeBits(32 - Math.clz32(frames));
  if (count > frames) throw new DamagedBlock(`Invalid block: ${count} frequencies for ${frames} frames.`);
  const q = new Float64Array(layout.count * 3 * count);
  const context = new ContextModel(prior, layout, count, step, durationLevel(frames, fps));
  for (let channel = 0; channel < channels; channel++) {
    const axes = layout.axes[channel];
    for (let k = 0; k < count; k++) {
      context.computeSharedSums(channel, k);
      for (let axis = 0; axis < axes; axis++) {
        const magnitude = decodeMagnitude(
          decoder,
          prior.hazard,
          HAZARD_OFFSET_OF[k],
          context.predictScale(channel, axis, k),
        );
        if (magnitude > 0) {
          const offset = (channel * 3 + axis) * count + k;
          const probability = prior.sign[FREQUENCY_CLASS_OF[k] * SIGN_CONTEXTS + signContext(q, offset, k)];
          q[offset] = decoder.decodeBit(probability) ? -magnitude : magnitude;
        }
        context.updateMagnitude(channel, axis, k, magnitude);
      }
      context.finishFrequency(channel, k);
    }
    context.finishChannel(channel);
  }
  return { frames, step, heading, count, q };
}

/** Decodes the magnitude of a coefficient at a predicted `scale`, with the hazard table at `tableOffset`. */
function decodeMagnitude(decoder: RangeDecoder, hazard: Int32Array, tableOffset: number, scale: number): number {
  const shift = scale >= 1024 ? (scale >> 8) - 3 : 0;
  const position = (scale - shift * 256 + 7 * 256) * 4;
  let row = position >> 8,
    weight = position & 255;
  if (row > HAZARD_ROWS - 2) {
    row = HAZARD_ROWS - 2;
    weight = 256;
  }
  let value = 0;
  for (let entry = tableOffset + row * UNARY_DECISIONS; value < UNARY_DECISIONS; value++, entry++) {
    if (!decoder.decodeBit((hazard[entry] * (256 - weight) + hazard[entry + UNARY_DECISIONS] * weight) >> 8)) break;
  }
  if (value === UNARY_DECISIONS) {
    let length = 0;
    while (length < MAX_ESCAPE_BITS && decoder.decodeBit(HALF_PROBABILITY)) length++;
    if (length === MAX_ESCAPE_BITS)
      throw new DamagedBlock(`Invalid block: an escape has ${MAX_ESCAPE_BITS} or more unary bits.`);
    value += ((1 << length) | decoder.decodeBits(length)) - 1;
  }
  // multiplied, not shifted: the largest magnitudes need 32 bits
  return shift > 0 ? value * (1 << shift) + decoder.decodeBits(shift) : value;
}
