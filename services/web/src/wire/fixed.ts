/** Messages of fixed layout, little-endian (`proto/SPEC.md`, Fixed messages): what is hot, to bytes and back. */

import { MalformedMessage } from "./errors";
import { empty, getU64, setU64, viewOf } from "./layout";
import { MOST_LIMBS } from "./limbs";
import { type Data, type Input, type Ping, type Pong, TARGET, TYPES } from "./messages";

/** Before the index of a block, which is LEB128 of three bytes at most. */
const DATA_HEADER = 2;
const MOST_INDEX_BYTES = 3;
const SHORT = 32;

function short(bytes: Uint8Array, name: string): DataView {
  if (bytes.length !== SHORT) throw new MalformedMessage(`${name} has ${SHORT} bytes, not ${bytes.length}`);
  return viewOf(bytes);
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
  const [bytes] = empty(TYPES.Data, DATA_HEADER + index.length + message.block.length);
  bytes[1] = (message.track << 4) | message.rate;
  bytes.set(index, DATA_HEADER);
  bytes.set(message.block, DATA_HEADER + index.length);
  return bytes;
}

export function unpackData(bytes: Uint8Array): Data {
  let index = 0;
  for (let i = 0; i < MOST_INDEX_BYTES && DATA_HEADER + i < bytes.length; i++) {
    const byte = bytes[DATA_HEADER + i];
    index |= (byte & 127) << (7 * i);
    if (byte < 128) {
      return { name: "Data", track: bytes[1] >> 4, rate: bytes[1] & 15, index, block: bytes.subarray(DATA_HEADER + i + 1) };
    }
  }
  throw new MalformedMessage("Data has a track and rate, an index of 1 to 3 bytes, and a block");
}

export function packPing(message: Ping): Uint8Array<ArrayBuffer> {
  const [bytes, view] = empty(TYPES.Ping, SHORT);
  view.setUint32(4, message.sequence, true);
  setU64(view, 8, message.sent);
  return bytes;
}

export function unpackPing(bytes: Uint8Array): Ping {
  const view = short(bytes, "Ping");
  return { name: "Ping", sequence: view.getUint32(4, true), sent: getU64(view, 8, "Ping's time") };
}

export function packPong(message: Pong): Uint8Array<ArrayBuffer> {
  const [bytes, view] = empty(TYPES.Pong, SHORT);
  view.setUint32(4, message.sequence, true);
  setU64(view, 8, message.sent);
  setU64(view, 16, message.received);
  setU64(view, 24, message.answered);
  return bytes;
}

export function unpackPong(bytes: Uint8Array): Pong {
  const view = short(bytes, "Pong");
  const [sent, received, answered] = [8, 16, 24].map((at) => getU64(view, at, "Pong's time"));
  return { name: "Pong", sequence: view.getUint32(4, true), sent, received, answered };
}

export function packInput(message: Input): Uint8Array<ArrayBuffer> {
  const [bytes, view] = empty(TYPES.Input, SHORT);
  bytes[1] = message.limb;
  bytes[2] = message.kind;
  view.setUint32(4, message.epoch, true);
  view.setUint32(8, message.sequence, true);
  setU64(view, 12, message.sampled);
  message.values.forEach((value, axis) => view.setFloat32(20 + 4 * axis, value, true));
  return bytes;
}

export function unpackInput(bytes: Uint8Array): Input {
  const view = short(bytes, "Input");
  const [, limb, kind] = bytes;
  if (limb >= MOST_LIMBS || kind > TARGET) {
    throw new MalformedMessage(`Input names limb ${limb}, kind ${kind}; there are ${MOST_LIMBS} limbs and 2 kinds`);
  }
  const values: [number, number, number] = [
    view.getFloat32(20, true), view.getFloat32(24, true), view.getFloat32(28, true),
  ];
  if (!values.every(Number.isFinite)) throw new MalformedMessage("Input holds a number that is not finite");
  return {
    name: "Input", limb, kind, epoch: view.getUint32(4, true), sequence: view.getUint32(8, true),
    sampled: getU64(view, 12, "Input's time"), values,
  };
}
