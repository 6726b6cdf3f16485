/** Integers of one to four bytes in LEB128 (`proto/codec.md`, 2.15). */

import { DamagedBlock } from "./errors";

/** Reader of the integers and bytes of a block, in order. */
export class Leb128Reader {
  /** Number of bytes read. */
  offset = 0;

  constructor(private readonly data: Uint8Array) {}

  /**
   * Returns the next integer.
   *
   * @throws DamagedBlock beyond four bytes or the data
   */
  read(): number {
    for (let value = 0, shift = 0; shift < 28 && this.offset < this.data.length; shift += 7) {
      const byte = this.data[this.offset++];
      value |= (byte & 127) << shift;
      if (byte < 128) return value;
    }
    throw new DamagedBlock("Invalid block: an integer must have 1 to 4 bytes.");
  }
}
