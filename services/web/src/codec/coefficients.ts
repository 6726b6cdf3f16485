/**
 * Bytes to the head and the quantised coefficients of one block (`proto/SPEC.md`, Motion block: Head, Order, Size, Sign), to
 * the same bits as the Python room `codec/kernels.py`.
 */

import { CHANNEL_COUNT } from "../motion/skeleton";
import { ContextModel, FREQUENCY_CLASS_OF, signContext } from "./context-model";
import { DamagedBlock } from "./errors";
import { magnitudeLevel } from "./magnitude-level";
import { HAZARD_ROWS, HAZARD_TABLE_OF, type Prior, SIGN_CONTEXTS, UNARY_DECISIONS } from "./prior";
import { HALF_PROBABILITY, RangeDecoder } from "./range-coder";

/** Most bytes of a block. */
export const MAX_BLOCK_BYTES = 65_536;

/** Most frames of a block. */
export const MAX_BLOCK_FRAMES = 512;

const NOMINAL_FRAMES_PROBABILITY = 32440;
const ROOT_ONLY_PROBABILITY = 512;
const MAX_ESCAPE_BITS = 20;

/** Of each frequency where its table of hazards starts. */
const HAZARD_OFFSET_OF = Uint16Array.from(
  FREQUENCY_CLASS_OF,
  (group) => HAZARD_TABLE_OF[group] * HAZARD_ROWS * UNARY_DECISIONS,
);

/** Channels of a camera's or a light's block; a motion's has 19. */
export const SCENE_CHANNEL_COUNT = 3;

/** A block as it stands in its bytes. */
export interface BlockCoefficients {
  frames: number;
  /** Step index, 0..255. */
  step: number;
  /** The turn about y that the root's rotations are relative to, in 1/64 of a whole one, -32..31; 0 of a scene. */
  heading: number;
  /** Frequencies of each track. */
  count: number;
  /** Whole numbers [channel][axis 3][`count`]; the largest there can be is a little above 2^31. */
  q: Float64Array;
}

/** Level of a block's duration in sixteenths of a second: a feature of its contexts. */
export function durationLevel(frames: number, fps: number): number {
  return magnitudeLevel(Math.floor((16 * frames) / fps + 0.5));
}

/**
 * Head and coefficients of a block of a motion with `fps` frames a second whose blocks have `usual` frames. The work is bounded
 * by 29,184 coefficients of at most 70 bits. A block of `SCENE_CHANNELS` says in its head neither channels nor a heading,
 * and its last channel has one axis.
 *
 * @throws DamagedBlock
 */
export function decodeCoefficients(
  prior: Prior,
  data: Uint8Array,
  nominalFrames: number,
  fps: number,
  channelCount = CHANNEL_COUNT,
): BlockCoefficients {
  if (data.length > MAX_BLOCK_BYTES) {
    throw new DamagedBlock(`a block has at most ${MAX_BLOCK_BYTES} bytes, not ${data.length}`);
  }
  const decoder = new RangeDecoder(data);
  const frames = decoder.decodeBit(NOMINAL_FRAMES_PROBABILITY) ? nominalFrames : decoder.decodeBits(10);
  if (frames < 1 || frames > MAX_BLOCK_FRAMES) {
    throw new DamagedBlock(`block says ${frames} frames; 1..${MAX_BLOCK_FRAMES} are allowed`);
  }
  const scene = channelCount === SCENE_CHANNEL_COUNT;
  const channels = !scene && decoder.decodeBit(ROOT_ONLY_PROBABILITY) ? 2 : channelCount;
  const step = decoder.decodeBits(8);
  const heading = scene ? 0 : decoder.decodeBits(6) - 32;
  const count = decoder.decodeBits(32 - Math.clz32(frames));
  if (count > frames) throw new DamagedBlock(`block says ${count} frequencies for ${frames} frames`);
  const q = new Float64Array(channelCount * 3 * count);
  const contexts = new ContextModel(prior, count, step, durationLevel(frames, fps));
  for (let channel = 0; channel < channels; channel++) {
    const axes = scene && channel === 2 ? 1 : 3;
    for (let k = 0; k < count; k++) {
      contexts.computeSharedSums(channel, k);
      for (let axis = 0; axis < axes; axis++) {
        const size = decodeMagnitude(
          decoder,
          prior.hazard,
          HAZARD_OFFSET_OF[k],
          contexts.predictScale(channel, axis, k),
        );
        if (size > 0) {
          const at = (channel * 3 + axis) * count + k;
          const odds = prior.sign[FREQUENCY_CLASS_OF[k] * SIGN_CONTEXTS + signContext(q, at, k)];
          q[at] = decoder.decodeBit(odds) ? -size : size;
        }
        contexts.updateMagnitude(channel, axis, k, size);
      }
      contexts.finishFrequency(channel, k);
    }
    contexts.finishChannel(channel);
  }
  return { frames, step, heading, count, q };
}

/** A coefficient's size where about 2^(`scale` / 256) is expected, by the table of hazards that starts at `table`. */
function decodeMagnitude(decoder: RangeDecoder, hazard: Int32Array, tableOffset: number, scale: number): number {
  const shift = scale >= 1024 ? (scale >> 8) - 3 : 0;
  const place = (scale - shift * 256 + 7 * 256) * 4;
  let row = place >> 8,
    weight = place & 255;
  if (row > HAZARD_ROWS - 2) {
    row = HAZARD_ROWS - 2;
    weight = 256;
  }
  let value = 0;
  for (let at = tableOffset + row * UNARY_DECISIONS; value < UNARY_DECISIONS; value++, at++) {
    if (!decoder.decodeBit((hazard[at] * (256 - weight) + hazard[at + UNARY_DECISIONS] * weight) >> 8)) break;
  }
  if (value === UNARY_DECISIONS) {
    let length = 0;
    while (length < MAX_ESCAPE_BITS && decoder.decodeBit(HALF_PROBABILITY)) length++;
    if (length === MAX_ESCAPE_BITS) throw new DamagedBlock(`block holds a number longer than ${MAX_ESCAPE_BITS} bits`);
    value += ((1 << length) | decoder.decodeBits(length)) - 1;
  }
  // no shift of bits: the largest sizes need 32
  return shift > 0 ? value * (1 << shift) + decoder.decodeBits(shift) : value;
}
