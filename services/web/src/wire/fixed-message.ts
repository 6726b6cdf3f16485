/** Messages of fixed layout, little-endian (`proto/SPEC.md`, Fixed messages): what is hot, to bytes and back. */

import { allocateMessage, dataViewOf, getU64, setU64 } from "./byte-layout";
import { MalformedMessage } from "./errors";
import { MAX_LIMBS } from "./limbs";
import { type Data, INPUT_TARGET, type Input, MESSAGE_TYPES, type Ping, type Pong } from "./messages";

/** Before the index of a block, which is LEB128 of three bytes at most. */
const DATA_HEADER_BYTES = 2;
const MAX_INDEX_BYTES = 3;
const FIXED_MESSAGE_BYTES = 32;

function viewOfFixedMessage(bytes: Uint8Array, name: string): DataView {
  if (bytes.length !== FIXED_MESSAGE_BYTES)
    throw new MalformedMessage(`${name} has ${FIXED_MESSAGE_BYTES} bytes, not ${bytes.length}`);
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
  throw new MalformedMessage("Data has a track and rate, an index of 1 to 3 bytes, and a block");
}

export function packPing(message: Ping): Uint8Array<ArrayBuffer> {
  const [bytes, view] = allocateMessage(MESSAGE_TYPES.Ping, FIXED_MESSAGE_BYTES);
  view.setUint32(4, message.sequence, true);
  setU64(view, 8, message.sent);
  return bytes;
}

export function unpackPing(bytes: Uint8Array): Ping {
  const view = viewOfFixedMessage(bytes, "Ping");
  return { name: "Ping", sequence: view.getUint32(4, true), sent: getU64(view, 8, "Ping's time") };
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
  const [sent, received, answered] = [8, 16, 24].map((at) => getU64(view, at, "Pong's time"));
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
    throw new MalformedMessage(`Input names limb ${limb}, kind ${kind}; there are ${MAX_LIMBS} limbs and 2 kinds`);
  }
  const values: [number, number, number] = [
    view.getFloat32(20, true),
    view.getFloat32(24, true),
    view.getFloat32(28, true),
  ];
  if (!values.every(Number.isFinite)) throw new MalformedMessage("Input holds a number that is not finite");
  return {
    name: "Input",
    limb,
    kind,
    epoch: view.getUint32(4, true),
    sequence: view.getUint32(8, true),
    sampled: getU64(view, 12, "Input's time"),
    values,
  };
}
