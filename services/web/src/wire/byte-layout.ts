/** What messages of fixed layout are made of: little-endian numbers behind a type byte. */

import { MalformedMessage } from "./errors";

const UINT32_RANGE = 2 ** 32;

export function dataViewOf(bytes: Uint8Array): DataView {
  return new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
}

/** Storage for a message of `size` bytes that begins with the byte `type`. */
export function allocateMessage(type: number, size: number): [Uint8Array<ArrayBuffer>, DataView] {
  const bytes = new Uint8Array(size);
  bytes[0] = type;
  return [bytes, dataViewOf(bytes)];
}

export function setU64(view: DataView, at: number, value: number): void {
  view.setUint32(at, value % UINT32_RANGE, true);
  view.setUint32(at + 4, Math.floor(value / UINT32_RANGE), true);
}

/** The number at `at`; `what` names it where it is more than a number holds exactly. */
export function getU64(view: DataView, at: number, fieldName: string): number {
  const value = view.getUint32(at + 4, true) * UINT32_RANGE + view.getUint32(at, true);
  if (!Number.isSafeInteger(value)) throw new MalformedMessage(`${fieldName} is past 2^53`);
  return value;
}
