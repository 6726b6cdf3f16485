/** Encoders and decoders of the messages of fixed layout (`proto/messages.md`, 3.4, 3.6 and 3.10). */

import { JOINT_COUNT } from "../motion/skeleton";
import { allocateMessage, dataViewOf, getU64, setU64 } from "./byte-layout";
import { MalformedMessage } from "./errors";
import { MAX_LIMBS } from "./limbs";
import { type Data, INPUT_TARGET, type Input, MESSAGE_TYPES, type Ping, type Pong, type Sample } from "./messages";

/** Bytes before the index of a block. */
const DATA_HEADER_BYTES = 2;
/** Bytes of the index at most, LEB128. */
const MAX_INDEX_BYTES = 3;
const FIXED_MESSAGE_BYTES = 32;
const SAMPLE_BYTES = 136;
/** Bound of each coordinate of a sample's root. */
export const MAX_ROOT_M = 100;
const SAMPLE_ROOT_AT = 16;
const SAMPLE_ROTATIONS_AT = 28;

function viewOfFixedMessage(bytes: Uint8Array, name: string): DataView {
  if (bytes.length !== FIXED_MESSAGE_BYTES)
    throw new MalformedMessage(`${name} has ${bytes.length} bytes, expected ${FIXED_MESSAGE_BYTES} bytes`);
  return dataViewOf(bytes);
}

export function packData(message: Data): Uint8Array<ArrayBuffer> {
  const index: number[] = [];
  for (let rest = message.index; ; rest >>= 7) {
    if (rest < 128) {
      index.push(rest);
      break;
    }
    index.push((rest & 127) | 128);
  }
  const [bytes] = allocateMessage(MESSAGE_TYPES.Data, DATA_HEADER_BYTES + index.length + message.block.length);
  bytes[1] = (message.track << 4) | message.rate;
  bytes.set(index, DATA_HEADER_BYTES);
  bytes.set(message.block, DATA_HEADER_BYTES + index.length);
  return bytes;
}

export function unpackData(bytes: Uint8Array): Data {
  let index = 0;
  for (let i = 0; i < MAX_INDEX_BYTES && DATA_HEADER_BYTES + i < bytes.length; i++) {
    const byte = bytes[DATA_HEADER_BYTES + i];
    index |= (byte & 127) << (7 * i);
    if (byte < 128) {
      return {
        name: "Data",
        track: bytes[1] >> 4,
        rate: bytes[1] & 15,
        index,
        block: bytes.subarray(DATA_HEADER_BYTES + i + 1),
      };
    }
  }
  throw new MalformedMessage("Data ends within its header, or its index has more than 3 bytes");
}

export function packPing(message: Ping): Uint8Array<ArrayBuffer> {
  const [bytes, view] = allocateMessage(MESSAGE_TYPES.Ping, FIXED_MESSAGE_BYTES);
  view.setUint32(4, message.sequence, true);
  setU64(view, 8, message.sent);
  return bytes;
}

export function unpackPing(bytes: Uint8Array): Ping {
  const view = viewOfFixedMessage(bytes, "Ping");
  return { name: "Ping", sequence: view.getUint32(4, true), sent: getU64(view, 8, "Ping, sent") };
}

export function packPong(message: Pong): Uint8Array<ArrayBuffer> {
  const [bytes, view] = allocateMessage(MESSAGE_TYPES.Pong, FIXED_MESSAGE_BYTES);
  view.setUint32(4, message.sequence, true);
  setU64(view, 8, message.sent);
  setU64(view, 16, message.received);
  setU64(view, 24, message.answered);
  return bytes;
}

export function unpackPong(bytes: Uint8Array): Pong {
  const view = viewOfFixedMessage(bytes, "Pong");
  const [sent, received, answered] = [8, 16, 24].map((at) => getU64(view, at, "Pong, a time"));
  return { name: "Pong", sequence: view.getUint32(4, true), sent, received, answered };
}

export function packInput(message: Input): Uint8Array<ArrayBuffer> {
  const [bytes, view] = allocateMessage(MESSAGE_TYPES.Input, FIXED_MESSAGE_BYTES);
  bytes[1] = message.limb;
  bytes[2] = message.kind;
  view.setUint32(4, message.epoch, true);
  view.setUint32(8, message.sequence, true);
  setU64(view, 12, message.sampled);
  message.values.forEach((value, axis) => view.setFloat32(20 + 4 * axis, value, true));
  return bytes;
}

export function unpackInput(bytes: Uint8Array): Input {
  const view = viewOfFixedMessage(bytes, "Input");
  const [, limb, kind] = bytes;
  if (limb >= MAX_LIMBS || kind > INPUT_TARGET) {
    throw new MalformedMessage(
      `Input has limb ${limb} and kind ${kind}, expected a limb of 0..${MAX_LIMBS - 1} and kind 0 or 1`,
    );
  }
  const values: [number, number, number] = [
    view.getFloat32(20, true),
    view.getFloat32(24, true),
    view.getFloat32(28, true),
  ];
  if (!values.every(Number.isFinite)) throw new MalformedMessage("Input has a value that is not finite");
  return {
    name: "Input",
    limb,
    kind,
    epoch: view.getUint32(4, true),
    sequence: view.getUint32(8, true),
    sampled: getU64(view, 12, "Input, sampled"),
    values,
  };
}

/** Encodes a sample: 136 bytes. */
export function packSample(message: Sample): Uint8Array<ArrayBuffer> {
  const [bytes, view] = allocateMessage(MESSAGE_TYPES.Sample, SAMPLE_BYTES);
  view.setUint32(4, message.sequence, true);
  setU64(view, 8, message.sampled);
  message.root.forEach((value, axis) => view.setFloat32(SAMPLE_ROOT_AT + 4 * axis, value, true));
  message.rotations.forEach((value, nth) => view.setInt16(SAMPLE_ROTATIONS_AT + 2 * nth, value, true));
  return bytes;
}

/** @throws MalformedMessage, also for a position beyond `MAX_ROOT_M` */
export function unpackSample(bytes: Uint8Array): Sample {
  if (bytes.length !== SAMPLE_BYTES)
    throw new MalformedMessage(`Sample has ${bytes.length} bytes, expected ${SAMPLE_BYTES} bytes`);
  const view = dataViewOf(bytes);
  const root: [number, number, number] = [
    view.getFloat32(SAMPLE_ROOT_AT, true),
    view.getFloat32(SAMPLE_ROOT_AT + 4, true),
    view.getFloat32(SAMPLE_ROOT_AT + 8, true),
  ];
  // numbers that are not finite are not within the bound either
  if (!root.every((coordinate) => Math.abs(coordinate) <= MAX_ROOT_M))
    throw new MalformedMessage(`Sample has a root position that is not within ${MAX_ROOT_M} m`);
  return {
    name: "Sample",
    sequence: view.getUint32(4, true),
    sampled: getU64(view, 8, "Sample, sampled"),
    root,
    rotations: Int16Array.from({ length: JOINT_COUNT * 3 }, (_, nth) =>
      view.getInt16(SAMPLE_ROTATIONS_AT + 2 * nth, true),
    ),
  };
}
