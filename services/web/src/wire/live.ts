/** Message 15: whole poses of live performers at an instant (`proto/messages.md`, 3.10). */

import { allocateMessage, dataViewOf, getU64, setU64 } from "./byte-layout";
import { MalformedMessage } from "./errors";
import { MAX_PERFORMERS } from "./limbs";
import { OVERLAY_FRAME_INTERVAL_US } from "./overlay";

/** Frames of one performer. */
export interface LiveBlock {
  /** Time from the capture of a pose until it is due, microseconds; a multiple of `AGE_UNIT_US`. */
  ageUs: number;
  /** Block (`proto/codec.md`, 2.16). */
  data: Uint8Array;
}

/** Whole poses of live performers. No message depends on another. */
export interface Live {
  name: "Live";
  /** Clock time at which the last frame is due, microseconds. */
  due: number;
  /** Number of frames, 1 to 16, `LIVE_FRAME_INTERVAL_US` apart. */
  frames: number;
  /** By performer; empty if no performer is shown live any more. */
  blocks: Map<number, LiveBlock>;
}

/** Type byte of the message. */
export const LIVE_TYPE = 15;
/** Interval between the frames of a message, microseconds. */
export const LIVE_FRAME_INTERVAL_US = OVERLAY_FRAME_INTERVAL_US;
/** Unit in which the age of poses is sent, microseconds. */
const AGE_UNIT_US = 4_000;
const MAX_AGE = 255;

const LIVE_HEADER_BYTES = 10;

export function packLive(message: Live): Uint8Array<ArrayBuffer> {
  const blocks = [...message.blocks].sort(([a], [b]) => a - b);
  const size = blocks.reduce((sum, [, { data }]) => sum + (data.length < 128 ? 2 : 3) + data.length, LIVE_HEADER_BYTES);
  const [bytes, view] = allocateMessage(LIVE_TYPE, size);
  bytes[1] = (message.frames - 1) << 4;
  setU64(view, 2, message.due);
  let at = LIVE_HEADER_BYTES;
  for (const [performer, { ageUs, data }] of blocks) {
    bytes[1] |= 1 << performer;
    bytes[at++] = Math.min(Math.round(ageUs / AGE_UNIT_US), MAX_AGE);
    if (data.length < 128) {
      bytes[at++] = data.length;
    } else {
      bytes[at++] = (data.length & 127) | 128;
      bytes[at++] = data.length >> 7;
    }
    bytes.set(data, at);
    at += data.length;
  }
  return bytes;
}

/** @throws MalformedMessage */
export function unpackLive(bytes: Uint8Array): Live {
  const requireBytes = (end: number) => {
    if (end > bytes.length)
      throw new MalformedMessage(`Live has ${bytes.length} bytes, expected at least ${end} bytes`);
  };
  requireBytes(LIVE_HEADER_BYTES);
  const blocks = new Map<number, LiveBlock>();
  let at = LIVE_HEADER_BYTES;
  for (let performer = 0; performer < MAX_PERFORMERS; performer++) {
    if (!((bytes[1] >> performer) & 1)) continue;
    requireBytes(at + 2);
    const ageUs = bytes[at++] * AGE_UNIT_US;
    let size = bytes[at++];
    if (size > 127) {
      requireBytes(at + 1);
      if (bytes[at] > 127) throw new MalformedMessage("Live has a size of more than 2 bytes");
      size = (size & 127) | (bytes[at++] << 7);
    }
    requireBytes(at + size);
    blocks.set(performer, { ageUs, data: bytes.subarray(at, at + size) });
    at += size;
  }
  if (at !== bytes.length) throw new MalformedMessage(`Live has ${bytes.length - at} bytes after its last block`);
  const due = getU64(dataViewOf(bytes), 2, "Live, due");
  return { name: "Live", due, frames: (bytes[1] >> 4) + 1, blocks };
}
