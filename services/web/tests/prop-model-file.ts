/** Models of stored props as the server makes them. */

/** Id of a stored prop. */
export const STORED_ID = "abcdefghijklmnopq234";
/** Form of the models that are written without another. */
export const EXTRAS = { pitch: Math.PI / 2, height: 0.02, palmOffset: 0 };

/** Corners of a staff of four sides along y: position, normal, colour and finish of each. */
const CORNERS = [
  { position: [0, -0.2, 0], normal: [0, -1, 0], colour: [0xffff, 0, 0, 0xffff], finish: [255, 0, 0, 0] },
  { position: [0.02, 0, 0], normal: [1, 0, 0], colour: [0, 0xffff, 0, 0xffff], finish: [128, 0, 0, 0] },
  { position: [0, 0, 0.02], normal: [0, 0, 1], colour: [0, 0, 0xffff, 0xffff], finish: [51, 255, 0, 0] },
  { position: [0, 0.7, 0], normal: [0, 1, 0], colour: [0x8000, 0x8000, 0x8000, 0xffff], finish: [51, 0, 255, 0] },
];
const INDICES = [0, 1, 2, 1, 3, 2];
const VERTEX_BYTES = 36;

/** Description of a model, which tests change. */
export type ModelJson = ReturnType<typeof describe>;

/**
 * Write a model. `change` gets the description and the vertices and indices before they are put together.
 */
export function writePropModel(
  change: (json: ModelJson, data: DataView<ArrayBuffer>) => void = () => undefined,
): ArrayBuffer {
  const vertexBytes = CORNERS.length * VERTEX_BYTES;
  const data = new DataView(new ArrayBuffer(vertexBytes + INDICES.length * 2));
  CORNERS.forEach(({ position, normal, colour, finish }, vertex) => {
    const start = vertex * VERTEX_BYTES;
    [...position, ...normal].forEach((value, i) => data.setFloat32(start + i * 4, value, true));
    colour.forEach((value, i) => data.setUint16(start + 24 + i * 2, value, true));
    finish.forEach((value, i) => data.setUint8(start + 32 + i, value));
  });
  INDICES.forEach((index, at) => data.setUint16(vertexBytes + at * 2, index, true));
  const json = describe(vertexBytes, data.byteLength);
  change(json, data);
  return joinChunks(JSON.stringify(json), new Uint8Array(data.buffer));
}

/** Put a GLB file together. */
export function joinChunks(json: string, binary: Uint8Array<ArrayBuffer>): ArrayBuffer {
  const text = new TextEncoder().encode(json.padEnd(Math.ceil(json.length / 4) * 4));
  const padded = Math.ceil(binary.length / 4) * 4;
  const file = new DataView(new ArrayBuffer(28 + text.length + padded));
  const bytes = new Uint8Array(file.buffer);
  [0x46546c67, 2, file.byteLength, text.length, 0x4e4f534a].forEach((word, i) => file.setUint32(i * 4, word, true));
  bytes.set(text, 20);
  file.setUint32(20 + text.length, padded, true);
  file.setUint32(24 + text.length, 0x004e4942, true);
  bytes.set(binary, 28 + text.length);
  return file.buffer;
}

function describe(vertexBytes: number, byteLength: number) {
  const vertices = { bufferView: 0, count: CORNERS.length };
  return {
    asset: { version: "2.0" },
    scene: 0,
    scenes: [{ nodes: [0] }],
    nodes: [{ mesh: 0, extras: EXTRAS }] as Record<string, unknown>[],
    meshes: [
      { primitives: [{ mode: 4, indices: 4, attributes: { POSITION: 0, NORMAL: 1, COLOR_0: 2, _FINISH: 3 } }] },
    ] as { primitives: Record<string, unknown>[] }[],
    accessors: [
      { ...vertices, byteOffset: 0, componentType: 5126, type: "VEC3" },
      { ...vertices, byteOffset: 12, componentType: 5126, type: "VEC3" },
      { ...vertices, byteOffset: 24, componentType: 5123, type: "VEC4", normalized: true },
      { ...vertices, byteOffset: 32, componentType: 5121, type: "VEC4", normalized: true },
      { bufferView: 1, count: INDICES.length, componentType: 5123, type: "SCALAR" },
    ] as Record<string, unknown>[],
    bufferViews: [
      { buffer: 0, byteOffset: 0, byteLength: vertexBytes, byteStride: VERTEX_BYTES },
      { buffer: 0, byteOffset: vertexBytes, byteLength: byteLength - vertexBytes },
    ] as Record<string, unknown>[],
    buffers: [{ byteLength }] as Record<string, unknown>[],
  };
}
