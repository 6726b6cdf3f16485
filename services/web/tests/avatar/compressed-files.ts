/** Compression of the figures in test files: meshes by meshopt or Draco, textures as KTX2. */
import draco3d from "draco3d";
import { MeshoptEncoder } from "meshoptimizer";
import { parseContainer } from "../../src/avatar/gltf/container";
import { container } from "./glb-container";

interface Accessor {
  bufferView?: number;
  byteOffset?: number;
  componentType: number;
  normalized?: boolean;
  count: number;
  type: string;
  min?: number[];
  max?: number[];
}
interface View {
  buffer: number;
  byteOffset?: number;
  byteLength: number;
  byteStride?: number;
  extensions?: Record<string, unknown>;
}
export interface GltfFile {
  accessors: Accessor[];
  bufferViews: View[];
  buffers: Record<string, unknown>[];
  meshes: { primitives: { attributes: Record<string, number>; indices: number; extensions?: unknown }[] }[];
  images?: unknown[];
  textures?: unknown[];
  extensionsUsed?: string[];
  extensionsRequired?: string[];
  [other: string]: unknown;
}

/** Units per metre of quantised positions. */
const POSITION_GRID = 4096;

/** Bytes that grow by views. */
class Buffer {
  readonly #parts: Uint8Array[] = [];
  #length = 0;

  get bytes(): Uint8Array {
    const bytes = new Uint8Array(this.#length);
    let at = 0;
    for (const part of this.#parts) {
      bytes.set(part, at);
      at += part.length;
    }
    return bytes;
  }

  /** Append bytes, aligned to 4; return their range. */
  add(part: Uint8Array): { buffer: 0; byteOffset: number; byteLength: number } {
    const padded = new Uint8Array(Math.ceil(part.length / 4) * 4);
    padded.set(part);
    this.#parts.push(padded);
    this.#length += padded.length;
    return { buffer: 0, byteOffset: this.#length - padded.length, byteLength: part.length };
  }
}

/** Return the description of a GLB file, which may be changed, and a reader of its views. */
export function readFile(file: Uint8Array<ArrayBuffer>): { json: GltfFile; view(index: number): Uint8Array } {
  const { json, binary } = parseContainer(file.buffer);
  const { bufferViews } = json as GltfFile;
  return {
    json: structuredClone(json) as GltfFile,
    view: (index) => {
      const { byteOffset = 0, byteLength } = bufferViews[index];
      return (binary ?? new Uint8Array()).slice(byteOffset, byteOffset + byteLength);
    },
  };
}

/** Compress all vertices and indices by meshopt, after quantising positions, normals and weights. */
export async function compressByMeshopt(file: Uint8Array<ArrayBuffer>): Promise<Uint8Array<ArrayBuffer>> {
  await MeshoptEncoder.ready;
  const { json, view } = readFile(file);
  const buffer = new Buffer();
  let fallbackBytes = 0;
  const compress = (index: number, bytes: Uint8Array, count: number, mode: string, filter = "NONE") => {
    const byteStride = bytes.length / count;
    const encoded = MeshoptEncoder.encodeGltfBuffer(bytes, count, byteStride, mode);
    json.bufferViews[index] = {
      buffer: 1,
      byteOffset: fallbackBytes,
      byteLength: bytes.length,
      ...(mode === "ATTRIBUTES" ? { byteStride } : {}),
      extensions: { EXT_meshopt_compression: { ...buffer.add(encoded), byteStride, count, mode, filter } },
    };
    fallbackBytes += Math.ceil(bytes.length / 4) * 4;
  };
  const [{ attributes, indices }] = json.meshes[0].primitives;
  const compressed = new Set<number>();
  const attribute = (name: string, convert: (accessor: Accessor, bytes: Uint8Array, index: number) => void) => {
    const accessor = json.accessors[attributes[name]];
    const index = accessor.bufferView as number;
    compressed.add(index);
    convert(accessor, view(index), index);
  };
  attribute("POSITION", (accessor, bytes, index) => {
    const values = new Float32Array(bytes.buffer);
    const grid = new Int16Array(accessor.count * 4);
    values.forEach((value, at) => {
      grid[Math.floor(at / 3) * 4 + (at % 3)] = Math.round(value * POSITION_GRID);
    });
    accessor.componentType = 5122;
    const { min = [], max = [] } = accessor;
    const toGrid = (value: number) => Math.round(value * POSITION_GRID);
    Object.assign(accessor, { min: min.map(toGrid), max: max.map(toGrid) });
    compress(index, new Uint8Array(grid.buffer), accessor.count, "ATTRIBUTES");
  });
  attribute("NORMAL", (accessor, bytes, index) => {
    const values = new Float32Array(accessor.count * 4);
    new Float32Array(bytes.buffer).forEach((value, at) => {
      values[Math.floor(at / 3) * 4 + (at % 3)] = value;
    });
    Object.assign(accessor, { componentType: 5120, normalized: true, min: undefined, max: undefined });
    compress(
      index,
      MeshoptEncoder.encodeFilterOct(values, accessor.count, 4, 8),
      accessor.count,
      "ATTRIBUTES",
      "OCTAHEDRAL",
    );
  });
  attribute("WEIGHTS_0", (accessor, bytes, index) => {
    const values = Uint8Array.from(new Float32Array(bytes.buffer), (weight) => Math.round(weight * 255));
    Object.assign(accessor, { componentType: 5121, normalized: true });
    compress(index, values, accessor.count, "ATTRIBUTES");
  });
  for (const name of ["JOINTS_0", "TEXCOORD_0"])
    if (name in attributes) attribute(name, ({ count }, bytes, index) => compress(index, bytes, count, "ATTRIBUTES"));
  const { bufferView, count } = json.accessors[indices];
  compressed.add(bufferView as number);
  compress(bufferView as number, view(bufferView as number), count, "TRIANGLES");
  // Positions are in units of the grid: the inverse bind matrices scale them.
  const [{ inverseBindMatrices }] = json.skins as { inverseBindMatrices: number }[];
  const matrices = json.accessors[inverseBindMatrices].bufferView as number;
  json.bufferViews.forEach((_, index) => {
    if (compressed.has(index)) return;
    const bytes = view(index);
    if (index === matrices) {
      const values = new Float32Array(bytes.buffer);
      values.forEach((value, at) => {
        if (at % 16 < 12) values[at] = value / POSITION_GRID;
      });
    }
    json.bufferViews[index] = buffer.add(bytes);
  });
  json.buffers = [
    { byteLength: buffer.bytes.length },
    { byteLength: fallbackBytes, extensions: { EXT_meshopt_compression: { fallback: true } } },
  ];
  return write(json, buffer.bytes, ["EXT_meshopt_compression", "KHR_mesh_quantization"]);
}

/** Compress the mesh by Draco. */
export async function compressByDraco(file: Uint8Array<ArrayBuffer>): Promise<Uint8Array<ArrayBuffer>> {
  const draco = await draco3d.createEncoderModule({});
  const { json, view } = readFile(file);
  const [primitive] = json.meshes[0].primitives;
  const accessorOf = (index: number) => json.accessors[index];
  const bytesOf = (index: number) => view(accessorOf(index).bufferView as number);
  const encoder = new draco.Encoder();
  const builder = new draco.MeshBuilder();
  const mesh = new draco.Mesh();
  const faces = new Uint16Array(bytesOf(primitive.indices).buffer);
  builder.AddFacesToMesh(mesh, faces.length / 3, Uint32Array.from(faces));
  const types: Record<string, number> = { POSITION: draco.POSITION, NORMAL: draco.NORMAL, TEXCOORD_0: draco.TEX_COORD };
  const ids: Record<string, number> = {};
  for (const [name, index] of Object.entries(primitive.attributes)) {
    const { componentType, count, type } = accessorOf(index);
    const kind = types[name] ?? draco.GENERIC;
    const width = { VEC2: 2, VEC3: 3, VEC4: 4 }[type] ?? 1;
    const bytes = bytesOf(index);
    ids[name] =
      componentType === 5126
        ? builder.AddFloatAttributeToMesh(mesh, kind, count, width, new Float32Array(bytes.buffer))
        : builder.AddUInt8Attribute(mesh, kind, count, width, bytes);
  }
  encoder.SetTrackEncodedProperties(true);
  const output = new draco.DracoInt8Array();
  const length = encoder.EncodeMeshToDracoBuffer(mesh, output);
  const encoded = Uint8Array.from({ length }, (_, at) => output.GetValue(at));
  const [points, triangles] = [encoder.GetNumberOfEncodedPoints(), encoder.GetNumberOfEncodedFaces()];
  const buffer = new Buffer();
  const replaced = new Set([...Object.values(primitive.attributes), primitive.indices]);
  json.bufferViews = json.bufferViews.map((_, index) => {
    const isReplaced = json.accessors.some(({ bufferView }, at) => bufferView === index && replaced.has(at));
    return buffer.add(isReplaced ? new Uint8Array(4) : view(index));
  });
  for (const index of replaced) {
    delete json.accessors[index].bufferView;
    json.accessors[index].count = index === primitive.indices ? triangles * 3 : points;
  }
  const bufferView = json.bufferViews.push(buffer.add(encoded)) - 1;
  primitive.extensions = { KHR_draco_mesh_compression: { bufferView, attributes: ids } };
  json.buffers = [{ byteLength: buffer.bytes.length }];
  return write(json, buffer.bytes, ["KHR_draco_mesh_compression"]);
}

/** Replace the picture of a dressed figure by a KTX2 texture in base64. */
export function withTexture(file: Uint8Array<ArrayBuffer>, base64: string): Uint8Array<ArrayBuffer> {
  const { json, view } = readFile(file);
  const [{ bufferView }] = json.images as { bufferView: number }[];
  const buffer = new Buffer();
  const texture = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
  json.bufferViews = json.bufferViews.map((old, index) => ({
    ...old,
    ...buffer.add(index === bufferView ? texture : view(index)),
  }));
  json.images = [{ bufferView, mimeType: "image/ktx2" }];
  json.textures = [{ extensions: { KHR_texture_basisu: { source: 0 } } }];
  json.buffers = [{ byteLength: buffer.bytes.length }];
  return write(json, buffer.bytes, ["KHR_texture_basisu"]);
}

function write(json: GltfFile, bytes: Uint8Array, extensions: readonly string[]): Uint8Array<ArrayBuffer> {
  json.extensionsUsed = [...new Set([...(json.extensionsUsed ?? []), ...extensions])];
  json.extensionsRequired = [...(json.extensionsRequired ?? []), ...extensions];
  return container(json, bytes);
}
