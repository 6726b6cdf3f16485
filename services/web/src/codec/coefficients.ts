/**
 * Bytes to the head and the quantised coefficients of one block (`proto/SPEC.md`, Motion block: Head, Order, Size, Sign), to
 * the same bits as the Python room `codec/kernels.py`.
 */

import { CHANNEL_COUNT } from "../motion/skeleton";
import { CLASS_OF, Contexts, signContext } from "./contexts";
import { DamagedBlock } from "./errors";
import { level } from "./levels";
import { HAZARD_OF, type Prior, ROWS, SIGNS, UNARY } from "./prior";
import { EVEN, RangeDecoder } from "./rangecoder";

/** Most bytes of a block. */
export const LARGEST_BLOCK = 65_536;

/** Most frames of a block. */
export const MOST_FRAMES = 512;

const FRAMES_AS_USUAL = 32440;
const ROOT_ALONE = 512;
const ESCAPE = 20;

/** Of each frequency where its table of hazards starts. */
const HAZARD_AT = Uint16Array.from(CLASS_OF, (group) => HAZARD_OF[group] * ROWS * UNARY);

/** Channels of a camera's or a light's block; a motion's has 19. */
export const SCENE_CHANNELS = 3;

/** A block as it stands in its bytes. */
export interface Coefficients {
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
export function lengthLevel(frames: number, fps: number): number {
  return level(Math.floor((16 * frames) / fps + 0.5));
}

/**
 * Head and coefficients of a block of a motion with `fps` frames a second whose blocks have `usual` frames. The work is bounded
 * by 29,184 coefficients of at most 70 bits. A block of `SCENE_CHANNELS` says in its head neither channels nor a heading,
 * and its last channel has one axis.
 *
 * @throws DamagedBlock
 */
export function decodeCoefficients(
  prior: Prior, data: Uint8Array, usual: number, fps: number, all = CHANNEL_COUNT,
): Coefficients {
  if (data.length > LARGEST_BLOCK) {
    throw new DamagedBlock(`a block has at most ${LARGEST_BLOCK} bytes, not ${data.length}`);
  }
  const decoder = new RangeDecoder(data);
  const frames = decoder.bit(FRAMES_AS_USUAL) ? usual : decoder.number(10);
  if (frames < 1 || frames > MOST_FRAMES) {
    throw new DamagedBlock(`block says ${frames} frames; 1..${MOST_FRAMES} are allowed`);
  }
  const scene = all === SCENE_CHANNELS;
  const channels = !scene && decoder.bit(ROOT_ALONE) ? 2 : all;
  const step = decoder.number(8);
  const heading = scene ? 0 : decoder.number(6) - 32;
  const count = decoder.number(32 - Math.clz32(frames));
  if (count > frames) throw new DamagedBlock(`block says ${count} frequencies for ${frames} frames`);
  const q = new Float64Array(all * 3 * count);
  const contexts = new Contexts(prior, count, step, lengthLevel(frames, fps));
  for (let channel = 0; channel < channels; channel++) {
    const axes = scene && channel === 2 ? 1 : 3;
    for (let k = 0; k < count; k++) {
      contexts.share(channel, k);
      for (let axis = 0; axis < axes; axis++) {
        const size = decodeSize(decoder, prior.hazard, HAZARD_AT[k], contexts.scale(channel, axis, k));
        if (size > 0) {
          const at = (channel * 3 + axis) * count + k;
          const odds = prior.sign[CLASS_OF[k] * SIGNS + signContext(q, at, k)];
          q[at] = decoder.bit(odds) ? -size : size;
        }
        contexts.see(channel, axis, k, size);
      }
      contexts.seeFrequency(channel, k);
    }
    contexts.seeChannel(channel);
  }
  return { frames, step, heading, count, q };
}

/** A coefficient's size where about 2^(`scale` / 256) is expected, by the table of hazards that starts at `table`. */
function decodeSize(decoder: RangeDecoder, hazard: Int32Array, table: number, scale: number): number {
  const shift = scale >= 1024 ? (scale >> 8) - 3 : 0;
  const place = (scale - shift * 256 + 7 * 256) * 4;
  let row = place >> 8, weight = place & 255;
  if (row > ROWS - 2) {
    row = ROWS - 2;
    weight = 256;
  }
  let value = 0;
  for (let at = table + row * UNARY; value < UNARY; value++, at++) {
    if (!decoder.bit((hazard[at] * (256 - weight) + hazard[at + UNARY] * weight) >> 8)) break;
  }
  if (value === UNARY) {
    let length = 0;
    while (length < ESCAPE && decoder.bit(EVEN)) length++;
    if (length === ESCAPE) throw new DamagedBlock(`block holds a number longer than ${ESCAPE} bits`);
    value += ((1 << length) | decoder.number(length)) - 1;
  }
  // no shift of bits: the largest sizes need 32
  return shift > 0 ? value * (1 << shift) + decoder.number(shift) : value;
}
