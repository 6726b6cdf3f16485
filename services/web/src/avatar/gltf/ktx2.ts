/** Check of a KTX2 texture before it is transcoded (KTX File Format 2.0, 3 and 4). */
import { translate } from "../../i18n/translator";
import { fileBroken } from "../error";
import { beyondEnd, invalidField, tooMuch } from "./schema";

const IDENTIFIER = [0xab, 0x4b, 0x54, 0x58, 0x20, 0x32, 0x30, 0xbb, 0x0d, 0x0a, 0x1a, 0x0a];
const HEADER_BYTES = 80;
const LEVEL_BYTES = 24;
/** Largest width and height that every WebGL 2 implementation of today's machines draws. */
const MAX_SIDE_PX = 8192;
const BYTES_PER_PIXEL = 4;
/** Bytes of a block of 4 x 4 pixels in UASTC, the larger of the two formats. */
const BLOCK_BYTES = 16;
/** Formats of `KHR_texture_basisu`: ETC1S with BasisLZ, and UASTC with or without Zstandard. */
const BASIS_LZ = 1;
const ZSTANDARD = 2;

/** Return the size of a texture when decoded, in bytes. Throw AvatarError if it is damaged or too large. */
export function checkKtx2(bytes: Uint8Array, field: string): number {
  if (bytes.length < HEADER_BYTES || IDENTIFIER.some((byte, at) => bytes[at] !== byte))
    throw fileBroken(translate("{field} is not a KTX2 texture", { field }));
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const number = (at: number) => view.getUint32(at, true);
  const [vkFormat, width, height, depth, layers, faces, levels, scheme] = [12, 20, 24, 28, 32, 36, 40, 44].map(number);
  if (vkFormat !== 0) throw invalidField(`${field}: vkFormat`, vkFormat);
  if (width === 0 || height === 0) throw invalidField(`${field}: ${width === 0 ? "pixelWidth" : "pixelHeight"}`, 0);
  if (width > MAX_SIDE_PX || height > MAX_SIDE_PX)
    throw tooMuch(field, `${width} x ${height}`, `${MAX_SIDE_PX} x ${MAX_SIDE_PX}`);
  if (depth > 0) throw invalidField(`${field}: pixelDepth`, depth);
  if (layers > 1) throw invalidField(`${field}: layerCount`, layers);
  if (faces !== 1) throw invalidField(`${field}: faceCount`, faces);
  if (levels > 1 + Math.floor(Math.log2(Math.max(width, height)))) throw invalidField(`${field}: levelCount`, levels);
  if (scheme > ZSTANDARD) throw invalidField(`${field}: supercompressionScheme`, scheme);
  for (const [at, name] of [[48, "dataFormatDescriptor"] as const, [56, "keyValueData"] as const])
    if (number(at) + number(at + 4) > bytes.length) throw beyondEnd(`${field}: ${name}`, field);
  const long = (at: number) => Number(view.getBigUint64(at, true));
  if (long(64) + long(72) > bytes.length) throw beyondEnd(`${field}: supercompressionGlobalData`, field);
  for (let level = 0; level < Math.max(1, levels); level++) {
    const at = HEADER_BYTES + level * LEVEL_BYTES;
    const name = `${field}: levels[${level}]`;
    if (at + LEVEL_BYTES > bytes.length || long(at) + long(at + 8) > bytes.length) throw beyondEnd(name, field);
    const blocks = Math.ceil(Math.max(1, width >> level) / 4) * Math.ceil(Math.max(1, height >> level) / 4);
    const uncompressed = long(at + 16);
    if (scheme !== BASIS_LZ && uncompressed !== blocks * BLOCK_BYTES)
      throw invalidField(`${name}.uncompressedByteLength`, uncompressed);
  }
  return width * height * BYTES_PER_PIXEL * (levels > 1 ? 4 / 3 : 1);
}
