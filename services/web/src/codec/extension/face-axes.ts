/** Face in a track: description of its axes, and layout of its blocks (`proto/codec.md`, 2.19). */

import { AXIS_COUNT, type Face } from "../../motion/face";
import { JOINTS } from "../../motion/skeleton";
import { type ChannelLayout, createLayout } from "../channel-layout";
import { DamagedBlock } from "../errors";
import { decodeIntegers } from "../integer-coder";
import { toScales } from "./scale-offsets";

const MAX_FACE_BYTES = 256;
const MASK_BYTES = AXIS_COUNT / 8;
const PRIOR_CHANNEL = JOINTS.indexOf("l_wrist") + 1;

/**
 * Returns the face that the bytes of `axes` describe, and the offsets of the scales of its axes.
 *
 * @throws DamagedBlock
 */
export function unpackFace(data: Uint8Array): [Face, number[]] {
  const axes = Array.from({ length: AXIS_COUNT }, (_, axis) => axis).filter(
    (axis) => ((data[axis >> 3] ?? 0) >> (axis & 7)) & 1,
  );
  if (axes.length === 0 || data.length < MASK_BYTES || data.length > MAX_FACE_BYTES) {
    throw new DamagedBlock(
      `Invalid face: its description has ${data.length} bytes, expected axes and ` +
        `${MASK_BYTES}..${MAX_FACE_BYTES} bytes.`,
    );
  }
  const groups = axes.map(() => 0);
  const mirrors = axes.map(() => -1);
  return [{ axes }, [...decodeIntegers(data.subarray(MASK_BYTES), groups, mirrors)]];
}

/** Returns the layout of the blocks: three axes a channel, each channel related to the two before it. */
export function faceLayout({ axes }: Face, offsets: readonly number[]): ChannelLayout {
  const channels = Array.from({ length: Math.ceil(axes.length / 3) }, (_, channel) => channel);
  return createLayout(
    channels.map(() => PRIOR_CHANNEL),
    channels.map((channel) => channel - 1),
    channels.map((channel) => Math.max(channel - 2, -1)),
    {
      axes: channels.map((channel) => Math.min(3, axes.length - 3 * channel)),
      scaleOffsets: toScales(offsets, channels.length),
    },
  );
}

/** Returns the inverses [count][3][3] of the weights of the channels: all axes count the same. */
export function inverseFaceWeights(count: number): Float64Array {
  return Float64Array.from({ length: count * 9 }, (_, at) => ((at % 9) % 4 === 0 ? 1 : 0));
}
