/** Container of binary glTF (glTF 2.0, 4: GLB file format): its JSON and its binary chunk. */
import { translate } from "../../i18n/translator";
import { AvatarError, EXPORT_AS_GLB, exportAgainHint, fileBroken, fileTooLarge, MAX_FILE_BYTES } from "../error";

const MAGIC = 0x46546c67;
const JSON_CHUNK = 0x4e4f534a;
const BINARY_CHUNK = 0x004e4942;
const HEADER_BYTES = 12;
const CHUNK_HEADER_BYTES = 8;
/** Size limit of the description, which is parsed at once. */
const MAX_JSON_BYTES = 32e6;

export interface GlbContent {
  readonly json: unknown;
  /** Content of the buffer without an address; null if there is none. */
  readonly binary: Uint8Array<ArrayBuffer> | null;
}

/** Return the content of a GLB file. Throw AvatarError if it is another file or damaged. */
export function parseContainer(bytes: ArrayBuffer): GlbContent {
  if (bytes.byteLength > MAX_FILE_BYTES) throw fileTooLarge(bytes.byteLength);
  const view = new DataView(bytes);
  if (bytes.byteLength < HEADER_BYTES || view.getUint32(0, true) !== MAGIC)
    throw new AvatarError(
      translate("Not a GLB file"),
      translate("it does not start like binary glTF"),
      translate(EXPORT_AS_GLB),
    );
  if (view.getUint32(4, true) !== 2)
    throw new AvatarError(
      translate("Unsupported glTF version"),
      translate("version {version}; only version 2 is supported", { version: view.getUint32(4, true) }),
      exportAgainHint(),
    );
  const end = view.getUint32(8, true);
  if (bytes.byteLength < HEADER_BYTES + CHUNK_HEADER_BYTES || end > bytes.byteLength)
    throw fileBroken(translate("the file is truncated"));
  let json: Uint8Array<ArrayBuffer> | null = null;
  let binary: Uint8Array<ArrayBuffer> | null = null;
  for (let at = HEADER_BYTES; at + CHUNK_HEADER_BYTES <= end; ) {
    const [length, type] = [view.getUint32(at, true), view.getUint32(at + 4, true)];
    at += CHUNK_HEADER_BYTES;
    if (at === HEADER_BYTES + CHUNK_HEADER_BYTES && (type !== JSON_CHUNK || at + length > end))
      throw fileBroken(translate("the JSON chunk is missing or too long"));
    if (at + length > end)
      throw fileBroken(
        translate("the chunk at byte {at} is {length} bytes long; the file has {rest} there", {
          at: at - CHUNK_HEADER_BYTES,
          length,
          rest: end - at,
        }),
      );
    const chunk = new Uint8Array(bytes, at, length);
    if (json === null) json = chunk;
    else if (type === BINARY_CHUNK) binary ??= chunk;
    at += length;
  }
  return { json: parseJson(json ?? new Uint8Array()), binary };
}

function parseJson(bytes: Uint8Array<ArrayBuffer>): unknown {
  if (bytes.length > MAX_JSON_BYTES) throw fileTooLarge(bytes.length, MAX_JSON_BYTES);
  try {
    return JSON.parse(new TextDecoder().decode(bytes));
  } catch {
    throw fileBroken(translate("the JSON chunk cannot be parsed"));
  }
}
