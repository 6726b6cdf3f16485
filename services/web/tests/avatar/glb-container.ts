/** Packing of accessors, an image and JSON into the bytes of a GLB file. */

type Part = readonly [
  values: Float32Array | Uint8Array | Uint16Array,
  type: "SCALAR" | "VEC2" | "VEC3" | "VEC4" | "MAT4",
  target: number | undefined,
];

const WIDTHS = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4, MAT4: 16 };

/** Concatenate the parts, followed by an image that has a view only. */
export function pack(
  parts: readonly Part[],
  picture: Uint8Array,
): { buffer: Uint8Array; views: unknown[]; accessors: unknown[] } {
  const views: unknown[] = [];
  const accessors: unknown[] = [];
  const bytes: number[] = [];
  for (const [values, type, target] of parts) {
    views.push({ buffer: 0, byteOffset: bytes.length, byteLength: values.byteLength, ...(target ? { target } : {}) });
    const width = WIDTHS[type];
    const bounds =
      type === "VEC3"
        ? {
            min: [0, 1, 2].map((k) => extreme(values, k, Math.min)),
            max: [0, 1, 2].map((k) => extreme(values, k, Math.max)),
          }
        : {};
    const componentType = values instanceof Float32Array ? 5126 : values instanceof Uint16Array ? 5123 : 5121;
    accessors.push({ bufferView: views.length - 1, componentType, count: values.length / width, type, ...bounds });
    for (const byte of new Uint8Array(values.buffer)) bytes.push(byte);
    while (bytes.length % 4) bytes.push(0);
  }
  views.push({ buffer: 0, byteOffset: bytes.length, byteLength: picture.length });
  bytes.push(...picture);
  while (bytes.length % 4) bytes.push(0);
  return { buffer: new Uint8Array(bytes), views, accessors };
}

function extreme(values: ArrayLike<number>, axis: number, of: (a: number, b: number) => number): number {
  let found = values[axis];
  for (let i = axis; i < values.length; i += 3) found = of(found, values[i]);
  return found;
}

/** Return the bytes of a GLB file with this JSON and binary chunk. */
export function container(json: unknown, buffer: Uint8Array): Uint8Array<ArrayBuffer> {
  const text = new TextEncoder().encode(JSON.stringify(json));
  const padded = Math.ceil(text.length / 4) * 4;
  const bytes = new Uint8Array(28 + padded + buffer.length);
  const view = new DataView(bytes.buffer);
  [0x46546c67, 2, bytes.length, padded, 0x4e4f534a].forEach((word, k) => view.setUint32(4 * k, word, true));
  bytes.fill(0x20, 20, 20 + padded).set(text, 20);
  view.setUint32(20 + padded, buffer.length, true);
  view.setUint32(24 + padded, 0x004e4942, true);
  bytes.set(buffer, 28 + padded);
  return bytes;
}
