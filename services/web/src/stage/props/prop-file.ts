/**
 * Reader of the models that the server makes of uploaded props (`proto/playback.md`, 4.12): glTF 2.0 with one mesh of
 * one primitive, and with the form of the prop in the `extras` of its only node. Anything else is rejected.
 */
import type { PropModel } from "../../motion/prop-model";
import type { PropForm } from "../../motion/props";

/** File that is not a model of a prop. */
export class PropFileError extends Error {
  override readonly name = "PropFileError";
}

/** Limits of a model: size of the file, vertices, triangles, and distance of anything from the grip. */
const MAX_BYTES = 4 << 20;
const MAX_VERTICES = 0xffff;
const MAX_TRIANGLES = 20_000;
const MAX_EXTENT_M = 100;

/** Container of binary glTF (glTF 2.0, 4). */
const MAGIC = 0x46546c67;
const JSON_CHUNK = 0x4e4f534a;
const BINARY_CHUNK = 0x004e4942;
const HEADER_BYTES = 12;
const CHUNK_HEADER_BYTES = 8;
/** The binary chunk may be longer than its buffer, up to a multiple of four. */
const MAX_PADDING_BYTES = 3;
/** Mode of a primitive of separate triangles. */
const TRIANGLES = 4;

/** Type of an accessor, and how its numbers are read. */
interface AccessorFormat {
  readonly componentType: number;
  readonly type: "SCALAR" | "VEC3" | "VEC4";
  readonly components: number;
  /** Bytes of one number. */
  readonly bytes: number;
  /** Divisor of normalised integers; null for numbers that are taken as they are. */
  readonly divisor: number | null;
  read(view: DataView, at: number): number;
}

const VECTOR: AccessorFormat = {
  componentType: 5126,
  type: "VEC3",
  components: 3,
  bytes: 4,
  divisor: null,
  read: (view, at) => view.getFloat32(at, true),
};
const readShort = (view: DataView, at: number) => view.getUint16(at, true);
const COLOUR: AccessorFormat = {
  componentType: 5123,
  type: "VEC4",
  components: 4,
  bytes: 2,
  divisor: 0xffff,
  read: readShort,
};
const FINISH: AccessorFormat = {
  componentType: 5121,
  type: "VEC4",
  components: 4,
  bytes: 1,
  divisor: 0xff,
  read: (view, at) => view.getUint8(at),
};
const INDEX: AccessorFormat = {
  componentType: 5123,
  type: "SCALAR",
  components: 1,
  bytes: 2,
  divisor: null,
  read: readShort,
};

/** Read the model of a stored prop. Throw PropFileError if the file is anything else. */
export function readPropModel(file: ArrayBuffer): PropModel {
  const { json, binary } = splitChunks(file);
  const gltf = asObject(json, "the JSON chunk");
  check(asObject(gltf["asset"], "asset")["version"] === "2.0", "asset.version is not 2.0");
  for (const part of ["extensionsRequired", "animations", "skins"])
    check(gltf[part] === undefined, `it has ${part}, which the model of a prop has not`);
  const buffer = onlyItem(gltf, "buffers");
  const length = wholeNumber(buffer["byteLength"], "buffers[0].byteLength");
  check(buffer["uri"] === undefined, "buffers[0] has an address");
  const padding = binary.byteLength - length;
  check(padding >= 0 && padding <= MAX_PADDING_BYTES, "buffers[0] is not the binary chunk");
  const node = onlyItem(gltf, "nodes");
  check(node["mesh"] === 0, "nodes[0] has not the mesh");
  for (const part of ["matrix", "translation", "rotation", "scale"])
    check(node[part] === undefined, `nodes[0] has a ${part}`);
  const [primitive, ...others] = asList(onlyItem(gltf, "meshes")["primitives"], "meshes[0].primitives");
  check(others.length === 0, "meshes[0] has several primitives");
  const { attributes, indices, mode = TRIANGLES } = asObject(primitive, "meshes[0].primitives[0]");
  check(mode === TRIANGLES, "meshes[0].primitives[0] has no separate triangles");
  const { POSITION, NORMAL, COLOR_0, _FINISH } = asObject(attributes, "meshes[0].primitives[0].attributes");
  const data = new DataView(binary.buffer, binary.byteOffset, length);
  const read = (index: unknown, format: AccessorFormat, maxCount: number) =>
    readAccessor(gltf, data, index, format, maxCount);
  const positions = read(POSITION, VECTOR, MAX_VERTICES);
  const shape = {
    positions,
    normals: read(NORMAL, VECTOR, MAX_VERTICES),
    colours: read(COLOR_0, COLOUR, MAX_VERTICES),
    finishes: read(_FINISH, FINISH, MAX_VERTICES),
    indices: Uint16Array.from(read(indices, INDEX, 3 * MAX_TRIANGLES)),
  };
  for (const values of [shape.normals, shape.colours, shape.finishes])
    check(values.length === positions.length, "the vertices have different numbers of attributes");
  check(positions.every(isWithinExtent), "a vertex is too far away, or no number");
  check(shape.normals.every(Number.isFinite), "a normal is no number");
  check(shape.indices.length > 0 && shape.indices.length % 3 === 0, "the indices are not those of triangles");
  check(
    shape.indices.every((index) => index < positions.length / 3),
    "an index is beyond the vertices",
  );
  return { form: readForm(asObject(node["extras"], "nodes[0].extras")), shape };
}

function readForm({ pitch, height, palmOffset }: Record<string, unknown>): PropForm {
  const number = (value: unknown, name: string, isAllowed: (value: number) => boolean): number => {
    check(typeof value === "number" && isAllowed(value), `nodes[0].extras.${name} is ${JSON.stringify(value)}`);
    return value as number;
  };
  return {
    rest: {
      pitch: number(pitch, "pitch", (value) => Math.abs(value) <= 2 * Math.PI),
      height: number(height, "height", isWithinExtent),
    },
    palmOffset: number(palmOffset, "palmOffset", (value) => value >= 0 && isWithinExtent(value)),
  };
}

/** Return the numbers of an accessor, three per vector: the fourth of colours and finishes is not used. */
function readAccessor(
  gltf: Record<string, unknown>,
  data: DataView,
  index: unknown,
  format: AccessorFormat,
  maxCount: number,
): Float32Array {
  const { components, bytes, divisor } = format;
  const name = `accessors[${String(index)}]`;
  const accessor = asObject(itemOf(gltf, "accessors", index), name);
  check(
    accessor["componentType"] === format.componentType && accessor["type"] === format.type,
    `${name} is not ${format.type} of ${format.componentType}`,
  );
  check((accessor["normalized"] ?? false) === (divisor !== null), `${name}.normalized is wrong`);
  check(accessor["sparse"] === undefined, `${name} is sparse`);
  const count = wholeNumber(accessor["count"], `${name}.count`);
  check(count > 0 && count <= maxCount, `${name}.count is ${count}`);
  const view = asObject(itemOf(gltf, "bufferViews", accessor["bufferView"]), `the view of ${name}`);
  check(view["buffer"] === 0, `the view of ${name} is of another buffer`);
  const viewStart = wholeNumber(view["byteOffset"] ?? 0, `byteOffset of the view of ${name}`);
  const viewLength = wholeNumber(view["byteLength"], `byteLength of the view of ${name}`);
  const start = wholeNumber(accessor["byteOffset"] ?? 0, `${name}.byteOffset`);
  const stride = wholeNumber(view["byteStride"] ?? components * bytes, `byteStride of the view of ${name}`);
  check(stride >= components * bytes, `byteStride of the view of ${name} is ${stride}`);
  check(viewStart + viewLength <= data.byteLength, `the view of ${name} ends beyond the buffer`);
  check(start + (count - 1) * stride + components * bytes <= viewLength, `${name} ends beyond its view`);
  const used = Math.min(components, 3);
  const values = new Float32Array(count * used);
  for (let item = 0; item < count; item++)
    for (let component = 0; component < used; component++) {
      const value = format.read(data, viewStart + start + item * stride + component * bytes);
      values[item * used + component] = value / (divisor ?? 1);
    }
  return values;
}

/** Return the description and the binary chunk of a GLB file with exactly these two. */
function splitChunks(file: ArrayBuffer): { json: unknown; binary: Uint8Array } {
  check(file.byteLength <= MAX_BYTES, `it has ${file.byteLength} bytes, more than ${MAX_BYTES}`);
  check(file.byteLength >= HEADER_BYTES, "it is truncated");
  const view = new DataView(file);
  check(view.getUint32(0, true) === MAGIC && view.getUint32(4, true) === 2, "it is no binary glTF 2.0");
  check(view.getUint32(8, true) === file.byteLength, "its length is another one than it states");
  const chunks: Uint8Array<ArrayBuffer>[] = [];
  let at = HEADER_BYTES;
  for (const type of [JSON_CHUNK, BINARY_CHUNK]) {
    check(at + CHUNK_HEADER_BYTES <= file.byteLength, "it is truncated");
    const length = view.getUint32(at, true);
    check(view.getUint32(at + 4, true) === type, "its chunks are not one of JSON and a binary one");
    at += CHUNK_HEADER_BYTES;
    check(at + length <= file.byteLength, "it is truncated");
    chunks.push(new Uint8Array(file, at, length));
    at += length;
  }
  check(at === file.byteLength, "it has more than two chunks");
  const [description, binary] = chunks;
  try {
    return { json: JSON.parse(new TextDecoder().decode(description)), binary };
  } catch {
    throw new PropFileError("Not the model of a prop: its JSON chunk cannot be parsed.");
  }
}

function check(condition: boolean, problem: string): asserts condition {
  if (!condition) throw new PropFileError(`Not the model of a prop: ${problem}.`);
}

/** Return the item of a list of which there is only one. */
function onlyItem(gltf: Record<string, unknown>, list: string): Record<string, unknown> {
  const items = asList(gltf[list], list);
  check(items.length === 1, `${list} has ${items.length} items, expected 1`);
  return asObject(items[0], `${list}[0]`);
}

function itemOf(gltf: Record<string, unknown>, list: string, index: unknown): unknown {
  return asList(gltf[list], list)[wholeNumber(index, `an index of ${list}`)];
}

function asObject(value: unknown, name: string): Record<string, unknown> {
  check(typeof value === "object" && value !== null && !Array.isArray(value), `${name} is missing`);
  return value as Record<string, unknown>;
}

function asList(value: unknown, name: string): readonly unknown[] {
  check(Array.isArray(value), `${name} is missing`);
  return value;
}

function wholeNumber(value: unknown, name: string): number {
  check(Number.isSafeInteger(value) && (value as number) >= 0, `${name} is ${JSON.stringify(value)}`);
  return value as number;
}

function isWithinExtent(value: number): boolean {
  return Math.abs(value) <= MAX_EXTENT_M;
}
