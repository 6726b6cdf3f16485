/**
 * Offsets of the scales that the context model predicts, one for each axis of a track (`proto/codec.md`, 2.18). The
 * prior has learned how joints of a body move: an axis that moves less or more than these is coded with an offset.
 */

import { DamagedBlock } from "../errors";

/** Unit of an offset: half a doubling, in the 1/256 of a doubling of the context model. */
const SCALE_UNIT = 128;
const MIN_SCALE_OFFSET = -8;
const MAX_SCALE_OFFSET = 7;

/** Returns the offsets [count][3] in the units of the context model; axes beyond the last have none. */
export function toScales(offsets: readonly number[], count: number): Int32Array {
  const scales = new Int32Array(count * 3);
  offsets.forEach((offset, axis) => {
    if (offset < MIN_SCALE_OFFSET || offset > MAX_SCALE_OFFSET)
      throw new DamagedBlock(
        `Invalid extension: the offset of a scale is ${offset}, expected ${MIN_SCALE_OFFSET}..${MAX_SCALE_OFFSET}.`,
      );
    scales[axis] = SCALE_UNIT * offset;
  });
  return scales;
}
