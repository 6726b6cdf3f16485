/** Messages 5 and 14: joints of controlled limbs at an instant (`proto/messages.md`, 3.5). */

import { LIMBS } from "../motion/skeleton";
import { allocateMessage, dataViewOf, getU64, setU64 } from "./byte-layout";
import { MalformedMessage } from "./errors";
import { MAX_LIMBS } from "./limbs";

/** Joints of the controlled limbs at clock time `due`. */
export interface Overlay {
  name: "Overlay";
  sequence: number;
  /** Clock time at which the last frame is due, microseconds. */
  due: number;
  /** By limb number three rotation vectors, nine integers in units of pi/32767. */
  limbs: Map<number, Int16Array>;
  /** Frames before this one with the same limbs, oldest first, `OVERLAY_FRAME_INTERVAL_US` apart. */
  earlier: Map<number, Int16Array>[];
}

/** Interval between the frames of an overlay, microseconds. */
export const OVERLAY_FRAME_INTERVAL_US = 16_667;

/** Type byte of an overlay with limbs of the first performer only, and of any other. */
export const OVERLAY_TYPE = 5;
export const MULTI_PERFORMER_OVERLAY_TYPE = 14;

/** Bytes before the frames; the second header ends with the mask. */
const SINGLE_PERFORMER_HEADER_BYTES = 12;
const MULTI_PERFORMER_HEADER_BYTES = 14;
const VALUES_PER_LIMB = 9;

export function packOverlay(message: Overlay): Uint8Array<ArrayBuffer> {
  const limbs = [...message.limbs.keys()].sort((a, b) => a - b);
  const frames = [...message.earlier, message.limbs];
  const mask = limbs.reduce((sum, limb) => sum | (1 << limb), 0);
  const several = mask >> LIMBS.length !== 0;
  const begin = several ? MULTI_PERFORMER_HEADER_BYTES : SINGLE_PERFORMER_HEADER_BYTES;
  const [bytes, view] = allocateMessage(
    several ? MULTI_PERFORMER_OVERLAY_TYPE : OVERLAY_TYPE,
    begin + frames.length * limbs.length * VALUES_PER_LIMB * 2,
  );
  bytes[1] = message.earlier.length << 4;
  view.setUint16(2, message.sequence, true);
  setU64(view, 4, message.due);
  if (several) view.setUint16(SINGLE_PERFORMER_HEADER_BYTES, mask, true);
  else bytes[1] |= mask;
  const numbers = frames.flatMap((frame) => limbs.flatMap((limb) => [...frame.get(limb)!]));
  numbers.forEach((number, i) => view.setInt16(begin + 2 * i, number, true));
  return bytes;
}

export function unpackOverlay(bytes: Uint8Array): Overlay {
  const several = bytes[0] === MULTI_PERFORMER_OVERLAY_TYPE;
  const begin = several ? MULTI_PERFORMER_HEADER_BYTES : SINGLE_PERFORMER_HEADER_BYTES;
  if (bytes.length < begin)
    throw new MalformedMessage(`Overlay has ${bytes.length} bytes, expected at least ${begin} bytes`);
  const view = dataViewOf(bytes);
  const mask = several ? view.getUint16(SINGLE_PERFORMER_HEADER_BYTES, true) : bytes[1] & 15;
  const held: number[] = [];
  for (let limb = 0; limb < MAX_LIMBS; limb++) if ((mask >> limb) & 1) held.push(limb);
  const frames = (bytes[1] >> 4) + 1;
  const size = begin + frames * held.length * VALUES_PER_LIMB * 2;
  if (bytes.length !== size) {
    throw new MalformedMessage(
      `Overlay has ${bytes.length} bytes, expected ${size} bytes for ${frames} frames of ${held.length} limbs`,
    );
  }
  const earlier = Array.from({ length: frames }, (_, frame) => {
    const limbs = new Map<number, Int16Array>();
    held.forEach((limb, nth) => {
      const at = begin + (frame * held.length + nth) * VALUES_PER_LIMB * 2;
      limbs.set(
        limb,
        Int16Array.from({ length: VALUES_PER_LIMB }, (_, i) => view.getInt16(at + 2 * i, true)),
      );
    });
    return limbs;
  });
  const limbs = earlier.pop()!;
  return {
    name: "Overlay",
    sequence: view.getUint16(2, true),
    due: getU64(view, 4, "Overlay, due"),
    limbs,
    earlier,
  };
}
