/** Little-endian fields of messages of fixed layout, after a type byte. */

import { MalformedMessage } from "./errors";

const UINT32_RANGE = 2 ** 32;

export function dataViewOf(bytes: Uint8Array): DataView {
  return new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
}

/** Allocates a message of `size` bytes with its type byte set. */
export function allocateMessage(type: number, size: number): [Uint8Array<ArrayBuffer>, DataView] {
  const bytes = new Uint8Array(size);
  bytes[0] = type;
  return [bytes, dataViewOf(bytes)];
}

export function setU64(view: DataView, at: number, value: number): void {
  view.setUint32(at, value % UINT32_RANGE, true);
  view.setUint32(at + 4, Math.floor(value / UINT32_RANGE), true);
}

/**
 * Reads the u64 at offset `at`.
 *
 * @param fieldName names the field in the error
 * @throws MalformedMessage if the value is not exact in a JavaScript number
 */
export function getU64(view: DataView, at: number, fieldName: string): number {
  const value = view.getUint32(at + 4, true) * UINT32_RANGE + view.getUint32(at, true);
  if (!Number.isSafeInteger(value)) throw new MalformedMessage(`${fieldName} is 2^53 or more`);
  return value;
}
