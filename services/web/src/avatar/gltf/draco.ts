/**
 * Check of Draco data before it is decoded (Draco Bitstream 2.2, 4 and 5): it decodes to no more than accessors say.
 */
import { translate } from "../../i18n/translator";
import { fileBroken } from "../error";
import { beyondEnd, invalidField } from "./schema";

const MAGIC = "DRACO";
const HEADER_BYTES = 11;
const TRIANGULAR_MESH = 1;
const EDGEBREAKER = 1;
const METADATA_FLAG = 0x8000;
/** Version of the bitstream from which on counts have a variable length: 2.2. */
const VARINT_VERSION = 0x0202;

/** Counts of the accessors; `faces` is null for points that are not connected. */
export interface DracoCounts {
  readonly points: number;
  readonly faces: number | null;
}

/**
 * Check that a mesh declares at most the counts of its accessors: degenerate faces may be left out, and vertices are
 * counted before they are divided at seams. Throw AvatarError.
 */
export function checkDraco(bytes: Uint8Array, field: string, expected: DracoCounts): void {
  const isDraco = [...MAGIC].every((letter, at) => bytes[at] === letter.charCodeAt(0));
  if (bytes.length < HEADER_BYTES || !isDraco) throw fileBroken(translate("{field} is not Draco data", { field }));
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const [version, type, method, flags] = [
    view.getUint8(5) * 256 + view.getUint8(6),
    view.getUint8(7),
    view.getUint8(8),
    view.getUint16(9, true),
  ];
  if (type !== TRIANGULAR_MESH || expected.faces === null) throw invalidField(`${field}: encoder_type`, type);
  // Metadata would have to be skipped by their own format, and glTF has none.
  if (version !== VARINT_VERSION) throw invalidField(`${field}: version`, `${version >> 8}.${version & 255}`);
  if ((flags & METADATA_FLAG) !== 0) throw invalidField(`${field}: flags`, flags);
  const numbers = new VarintReader(bytes, HEADER_BYTES, field);
  let faces: number;
  let points: number;
  if (method === EDGEBREAKER) {
    numbers.skip(1);
    points = numbers.read();
    faces = numbers.read();
  } else {
    faces = numbers.read();
    points = numbers.read();
  }
  if (faces > expected.faces) throw invalidField(`${field}: num_faces`, faces);
  if (points > expected.points) throw invalidField(`${field}: num_points`, points);
}

/** Reader of unsigned numbers with seven bits per byte, the lowest first. */
class VarintReader {
  constructor(
    private readonly bytes: Uint8Array,
    private at: number,
    private readonly field: string,
  ) {}

  skip(count: number): void {
    this.at += count;
  }

  read(): number {
    for (let value = 0, scale = 1; scale < 2 ** 35; scale *= 128) {
      if (this.at >= this.bytes.length) throw beyondEnd(this.field, "bufferView");
      const byte = this.bytes[this.at++];
      value += (byte & 127) * scale;
      if (byte < 128) return value;
    }
    throw invalidField(this.field, "varint");
  }
}
