/** Builder of a glTF 2.0 asset and its GLB file (Khronos, glTF 2.0 specification). */

const COMPONENT_TYPES = new Map<unknown, number>([
  [Uint8Array, 5121],
  [Uint16Array, 5123],
  [Uint32Array, 5125],
  [Float32Array, 5126],
]);
const COMPONENTS_PER_ELEMENT = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4, MAT4: 16 } as const;
/** Purposes of buffer views. */
const BUFFER_TARGETS = { vertices: 34962, indices: 34963 } as const;

export type GltfArray =
  | Uint8Array<ArrayBuffer>
  | Uint16Array<ArrayBuffer>
  | Uint32Array<ArrayBuffer>
  | Float32Array<ArrayBuffer>;

export interface GltfNode {
  name: string;
  children?: number[];
  translation?: number[];
  /** x y z w */
  rotation?: number[];
  mesh?: number;
  skin?: number;
}

/** Properties that channels change, and the types of their values. */
const CHANNEL_TYPES = { translation: "VEC3", rotation: "VEC4", scale: "VEC3", weights: "SCALAR" } as const;

export class GltfBuilder {
  /** Further properties of the asset: meshes, materials, skins, extensions. */
  readonly extraProperties: Record<string, unknown> = {};
  readonly nodes: GltfNode[] = [];
  readonly #accessors: Record<string, unknown>[] = [];
  readonly #views: Record<string, unknown>[] = [];
  readonly #parts: Uint8Array<ArrayBuffer>[] = [];
  readonly #samplers: Record<string, unknown>[] = [];
  readonly #channels: Record<string, unknown>[] = [];
  #length = 0;

  /** Add a buffer view of these bytes. Return its index. */
  addBufferView(values: GltfArray, target?: keyof typeof BUFFER_TARGETS): number {
    const bytes = new Uint8Array(values.buffer, values.byteOffset, values.byteLength);
    this.#views.push({
      buffer: 0,
      byteOffset: this.#length,
      byteLength: bytes.length,
      ...(target ? { target: BUFFER_TARGETS[target] } : {}),
    });
    this.#append(bytes, 0);
    return this.#views.length - 1;
  }

  /**
   * Add an accessor of these values. Return its index. `bounded` adds minimum and maximum, which positions and times
   * require.
   */
  addAccessor(
    values: GltfArray,
    type: keyof typeof COMPONENTS_PER_ELEMENT,
    { target, bounded = false }: { target?: keyof typeof BUFFER_TARGETS; bounded?: boolean } = {},
  ): number {
    const width = COMPONENTS_PER_ELEMENT[type];
    const each = (combine: (...numbers: number[]) => number) =>
      Array.from({ length: width }, (_, part) => {
        let bound = values[part];
        for (let at = part + width; at < values.length; at += width) bound = combine(bound, values[at]);
        return bound;
      });
    const bounds = bounded ? { min: each(Math.min), max: each(Math.max) } : {};
    this.#accessors.push({
      bufferView: this.addBufferView(values, target),
      componentType: COMPONENT_TYPES.get(values.constructor),
      count: values.length / width,
      type,
      ...bounds,
    });
    return this.#accessors.length - 1;
  }

  /**
   * Add an accessor of vectors (3) with minimum and maximum, of which only those that are not zero are stored. Return
   * its index.
   */
  addSparseAccessor(values: Float32Array<ArrayBuffer>): number {
    const count = values.length / 3;
    const vectors = Array.from({ length: count }, (_, at) => values.subarray(at * 3, at * 3 + 3));
    const used = vectors.flatMap((vector, at) => (vector.some((value) => value !== 0) ? [at] : []));
    const bound = (combine: (...numbers: number[]) => number) =>
      [0, 1, 2].map((axis) =>
        used.reduce((found, at) => combine(found, vectors[at][axis]), used.length < count ? 0 : vectors[0][axis]),
      );
    const stored = new Float32Array(used.flatMap((at) => [...vectors[at]]));
    const sparse = () => ({
      count: used.length,
      indices: { bufferView: this.addBufferView(Uint16Array.from(used)), componentType: 5123 },
      values: { bufferView: this.addBufferView(stored) },
    });
    this.#accessors.push({
      componentType: 5126,
      count,
      type: "VEC3",
      min: bound(Math.min),
      max: bound(Math.max),
      // An accessor without data is zero.
      ...(used.length > 0 ? { sparse: sparse() } : {}),
    });
    return this.#accessors.length - 1;
  }

  /**
   * Add a channel that changes a node to `values` at the times of an accessor: linearly between them, or with STEP at
   * once.
   */
  addChannel(
    node: number,
    path: keyof typeof CHANNEL_TYPES,
    times: number,
    values: Float32Array<ArrayBuffer>,
    interpolation: "LINEAR" | "STEP" = "LINEAR",
  ): void {
    this.#samplers.push({
      input: times,
      output: this.addAccessor(values, CHANNEL_TYPES[path]),
      interpolation,
    });
    this.#channels.push({ sampler: this.#samplers.length - 1, target: { node, path } });
  }

  /** Return the file in parts. `roots` are the nodes of its scene. */
  build(roots: readonly number[], animationName: string): Uint8Array<ArrayBuffer>[] {
    const json = {
      asset: { version: "2.0", generator: "Bunraku" },
      scene: 0,
      scenes: [{ nodes: roots }],
      nodes: this.nodes,
      animations: [{ name: animationName, samplers: this.#samplers, channels: this.#channels }],
      accessors: this.#accessors,
      bufferViews: this.#views,
      buffers: [{ byteLength: this.#length }],
      ...this.extraProperties,
    };
    const text = new TextEncoder().encode(JSON.stringify(json));
    const paddedJson = new Uint8Array(Math.ceil(text.length / 4) * 4).fill(0x20);
    paddedJson.set(text);
    const totalBytes = 12 + 8 + paddedJson.length + 8 + this.#length;
    return [
      uint32Bytes(0x46546c67, 2, totalBytes),
      uint32Bytes(paddedJson.length, 0x4e4f534a),
      paddedJson,
      uint32Bytes(this.#length, 0x004e4942),
      ...this.#parts,
    ];
  }

  #append(bytes: Uint8Array<ArrayBuffer>, filler: number): void {
    this.#parts.push(bytes);
    const padding = (4 - (bytes.length % 4)) % 4;
    if (padding > 0) this.#parts.push(new Uint8Array(padding).fill(filler));
    this.#length += bytes.length + padding;
  }
}

/** Return 32-bit integers in little-endian order. */
function uint32Bytes(...numbers: number[]): Uint8Array<ArrayBuffer> {
  const view = new DataView(new ArrayBuffer(numbers.length * 4));
  numbers.forEach((number, at) => view.setUint32(at * 4, number, true));
  return new Uint8Array(view.buffer);
}

/** Return the times of `frames` frames, in seconds. */
export function frameTimes(frames: number, fps: number): Float32Array<ArrayBuffer> {
  return Float32Array.from({ length: frames }, (_, frame) => frame / fps);
}

/**
 * Write the quaternion w x y z at `at` as glTF's x y z w at `outAt`. Of its two signs the one nearer to the last
 * rotation is used, for readers that do not take the shorter way.
 */
export function writeRotation(out: Float32Array, outAt: number, q: Float64Array, at: number): void {
  const [w, x, y, z] = [q[at], q[at + 1], q[at + 2], q[at + 3]];
  const previous = outAt - 4;
  const sign =
    previous >= 0 && out[previous] * x + out[previous + 1] * y + out[previous + 2] * z + out[previous + 3] * w < 0
      ? -1
      : 1;
  const scale = sign / Math.hypot(w, x, y, z);
  out[outAt] = x * scale;
  out[outAt + 1] = y * scale;
  out[outAt + 2] = z * scale;
  out[outAt + 3] = w * scale;
}
