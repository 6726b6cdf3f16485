/**
 * Check of a file's binary data before it is decoded: every view and accessor lies within its buffer, and what is
 * compressed is bounded when decoded (glTF 2.0, 3.6; EXT_meshopt_compression).
 */
import { translate } from "../../i18n/translator";
import { AvatarError, EXPORT_AS_GLB } from "../error";
import { asRecord, asText, type JsonRecord } from "./json";
import { beyondEnd, type GltfJson, invalidField, tooMuch, wholeNumber } from "./schema";

/** Limit of all decoded vertices and indices together, in bytes. */
export const MAX_DATA_BYTES = 256e6;

const COMPONENT_BYTES: Readonly<Record<number, number>> = { 5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4 };
const COMPONENTS: Readonly<Record<string, number>> = {
  SCALAR: 1,
  VEC2: 2,
  VEC3: 3,
  VEC4: 4,
  MAT2: 4,
  MAT3: 9,
  MAT4: 16,
};
const MESHOPT_EXTENSIONS = ["EXT_meshopt_compression", "KHR_meshopt_compression"];
const MESHOPT_MODES = ["ATTRIBUTES", "TRIANGLES", "INDICES"];
const MESHOPT_FILTERS = ["NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"];

/** Check buffers, views and accessors; `binaryBytes` is the length of the binary chunk. Throw AvatarError. */
export function checkData(json: GltfJson, binaryBytes: number): void {
  json.list("buffers").forEach((_, index) => {
    checkBuffer(json, index, binaryBytes);
  });
  let decodedBytes = 0;
  const count = (bytes: number, field: string) => {
    decodedBytes += bytes;
    if (decodedBytes > MAX_DATA_BYTES) throw tooMuch(field, megabytes(decodedBytes), megabytes(MAX_DATA_BYTES));
  };
  json.list("bufferViews").forEach((_, index) => {
    count(checkView(json, index), `bufferViews[${index}]`);
  });
  json.list("accessors").forEach((_, index) => {
    count(checkAccessor(json, index), `accessors[${index}].count`);
  });
}

/** Return a size for the user. */
export function megabytes(bytes: number): string {
  return `${Math.ceil(bytes / 1e6)} MB`;
}

/** Return the meshopt compression of a view or buffer and its field; null if it has none. */
function meshoptOf(item: JsonRecord, field: string): { extension: JsonRecord; field: string } | null {
  const extensions = asRecord(item.extensions);
  const name = MESHOPT_EXTENSIONS.find((extension) => extensions[extension] !== undefined);
  return name ? { extension: asRecord(extensions[name]), field: `${field}.extensions.${name}` } : null;
}

function checkBuffer(json: GltfJson, index: number, binaryBytes: number): void {
  const buffer = json.item("buffers", index);
  const field = `buffers[${index}]`;
  const length = wholeNumber(buffer.byteLength, `${field}.byteLength`, undefined, 1);
  const uri = asText(buffer.uri);
  if (uri) throw externalFile(uri);
  // Content of a fallback buffer is that of the compressed views; it need not be stored.
  if (meshoptOf(buffer, field)?.extension.fallback === true) return;
  if (index > 0) throw invalidField(`${field}.uri`, undefined);
  if (length > binaryBytes) throw beyondEnd(`${field}.byteLength`, translate("the file"));
}

/** Return the error for a file that needs others. */
export function externalFile(address: string): AvatarError {
  return new AvatarError(
    translate("Not a single file"),
    translate("it refers to the external file {address}", { address: address.slice(0, 60) }),
    translate(EXPORT_AS_GLB),
  );
}

/** Check a view. Return the number of bytes that it takes beside the file's, when decoded. */
function checkView(json: GltfJson, index: number): number {
  const view = json.item("bufferViews", index);
  const field = `bufferViews[${index}]`;
  const bytes = checkRange(json, view, field);
  const compressed = meshoptOf(view, field);
  if (!compressed) {
    const buffer = json.item("buffers", wholeNumber(view.buffer, field));
    if (meshoptOf(buffer, "")?.extension.fallback === true) throw invalidField(`${field}.buffer`, view.buffer);
    return 0;
  }
  const { extension } = compressed;
  checkRange(json, extension, compressed.field);
  const stride = wholeNumber(extension.byteStride, `${compressed.field}.byteStride`, undefined, 1);
  const count = wholeNumber(extension.count, `${compressed.field}.count`, undefined, 1);
  const { mode, filter = "NONE" } = extension;
  if (!MESHOPT_MODES.includes(String(mode))) throw invalidField(`${compressed.field}.mode`, mode);
  if (!MESHOPT_FILTERS.includes(String(filter))) throw invalidField(`${compressed.field}.filter`, filter);
  const isStridePossible = mode === "ATTRIBUTES" ? stride % 4 === 0 && stride <= 256 : stride === 2 || stride === 4;
  const filterStrides: Readonly<Record<string, readonly number[]>> = {
    OCTAHEDRAL: [4, 8],
    QUATERNION: [8],
    COLOR: [4, 8],
  };
  if (!isStridePossible || !(filterStrides[String(filter)] ?? [stride]).includes(stride))
    throw invalidField(`${compressed.field}.byteStride`, stride);
  if (filter !== "NONE" && mode !== "ATTRIBUTES") throw invalidField(`${compressed.field}.filter`, filter);
  if (mode === "TRIANGLES" && count % 3 !== 0) throw invalidField(`${compressed.field}.count`, count);
  if (count * stride !== bytes) throw invalidField(`${compressed.field}.count`, count);
  return bytes;
}

/** Check that a range lies within its buffer. Return its length in bytes. */
function checkRange(json: GltfJson, range: JsonRecord, field: string): number {
  const buffer = json.reference("buffers", range.buffer, `${field}.buffer`);
  const offset = wholeNumber(range.byteOffset, `${field}.byteOffset`, 0);
  const length = wholeNumber(range.byteLength, `${field}.byteLength`, undefined, 1);
  const bufferBytes = wholeNumber(json.item("buffers", buffer).byteLength, `buffers[${buffer}].byteLength`);
  if (offset + length > bufferBytes) throw beyondEnd(field, `buffers[${buffer}]`);
  return length;
}

/** Check an accessor. Return its size in bytes. */
function checkAccessor(json: GltfJson, index: number): number {
  const accessor = json.item("accessors", index);
  const field = `accessors[${index}]`;
  const elementBytes = elementSize(accessor, field);
  const count = wholeNumber(accessor.count, `${field}.count`, undefined, 1);
  if (accessor.bufferView !== undefined) checkElements(json, accessor, field, count, elementBytes);
  const sparse = accessor.sparse === undefined ? null : asRecord(accessor.sparse);
  if (sparse) {
    const changed = wholeNumber(sparse.count, `${field}.sparse.count`, undefined, 1);
    if (changed > count) throw invalidField(`${field}.sparse.count`, changed);
    const indices = asRecord(sparse.indices);
    const indexBytes = elementSize({ ...indices, type: "SCALAR" }, `${field}.sparse.indices`);
    checkElements(json, indices, `${field}.sparse.indices`, changed, indexBytes);
    checkElements(json, asRecord(sparse.values), `${field}.sparse.values`, changed, elementBytes);
  }
  return count * elementBytes;
}

/** Return the size of one element of an accessor, in bytes. */
function elementSize(accessor: JsonRecord, field: string): number {
  const componentBytes = COMPONENT_BYTES[Number(accessor.componentType)];
  if (componentBytes === undefined) throw invalidField(`${field}.componentType`, accessor.componentType);
  const components = Object.hasOwn(COMPONENTS, String(accessor.type)) ? COMPONENTS[String(accessor.type)] : undefined;
  if (components === undefined) throw invalidField(`${field}.type`, accessor.type);
  return componentBytes * components;
}

/** Check that `count` elements lie within the view of an accessor, or of a part of it. */
function checkElements(json: GltfJson, part: JsonRecord, field: string, count: number, elementBytes: number): void {
  const index = json.reference("bufferViews", part.bufferView, `${field}.bufferView`);
  const view = json.item("bufferViews", index);
  const stride = wholeNumber(view.byteStride, `bufferViews[${index}].byteStride`, elementBytes, 1);
  const offset = wholeNumber(part.byteOffset, `${field}.byteOffset`, 0);
  if (offset + stride * (count - 1) + elementBytes > wholeNumber(view.byteLength, `bufferViews[${index}].byteLength`))
    throw beyondEnd(field, `bufferViews[${index}]`);
}
