import { expect, test } from "vitest";
import { frameTimes, GltfBuilder, writeRotation } from "../../src/export/gltf";
import { joinParts } from "./motions";

test("a GLB has its length, JSON and data where the format requires", async () => {
  const asset = new GltfBuilder();
  asset.nodes.push({ name: "only" });
  const bytes = asset.addAccessor(Uint8Array.of(1, 2, 3), "SCALAR");
  const times = asset.addAccessor(frameTimes(3, 2), "SCALAR", { bounded: true });
  asset.addChannel(0, "translation", times, Float32Array.of(0, 0, 0, 1, -2, 3, 4, 5, 6));
  const file = new DataView(await joinParts(asset.build([0], "dänce")));
  const word = (at: number) => file.getUint32(at, true);
  expect([word(0), word(4), word(8)]).toEqual([0x46546c67, 2, file.byteLength]);
  const length = word(12);
  expect([word(16), length % 4, file.byteLength % 4]).toEqual([0x4e4f534a, 0, 0]);
  const json = JSON.parse(new TextDecoder().decode(new Uint8Array(file.buffer, 20, length))) as Record<
    string,
    { [key: string]: unknown }[]
  >;
  expect(word(20 + length)).toBe(json.buffers[0].byteLength);
  expect(json.animations[0].name).toBe("dänce");
  expect(json.accessors[bytes]).toMatchObject({ componentType: 5121, count: 3, type: "SCALAR" });
  expect(json.accessors[times]).toMatchObject({ min: [0], max: [1], count: 3 });
  const { byteOffset } = json.bufferViews[json.accessors[times].bufferView as number];
  expect(byteOffset).toBe(4);
  expect(file.getFloat32(28 + length + 4 + 8, true)).toBe(1);
});

test("a sparse accessor stores the vectors that are not zero, with the bounds of all", async () => {
  const asset = new GltfBuilder();
  asset.addSparseAccessor(Float32Array.of(0, 0, 0, 1, -2, 3, 0, 0, 0, 4, -1, 0));
  asset.addSparseAccessor(Float32Array.of(1, 2, -3, 4, 1, -1));
  asset.addSparseAccessor(new Float32Array(6));
  const file = await joinParts(asset.build([], "still"));
  const length = new DataView(file).getUint32(12, true);
  const json = JSON.parse(new TextDecoder().decode(new Uint8Array(file, 20, length))) as {
    accessors: { sparse?: object }[];
    bufferViews: { byteOffset: number; byteLength: number }[];
  };
  const bytes = (view: number) => {
    const { byteOffset, byteLength } = json.bufferViews[view];
    return file.slice(28 + length + byteOffset, 28 + length + byteOffset + byteLength);
  };
  expect(json.accessors).toEqual([
    {
      componentType: 5126,
      count: 4,
      type: "VEC3",
      min: [0, -2, 0],
      max: [4, 0, 3],
      sparse: { count: 2, indices: { bufferView: 0, componentType: 5123 }, values: { bufferView: 1 } },
    },
    expect.objectContaining({ count: 2, min: [1, 1, -3], max: [4, 2, -1] }),
    { componentType: 5126, count: 2, type: "VEC3", min: [0, 0, 0], max: [0, 0, 0] },
  ]);
  expect([...new Uint16Array(bytes(0))]).toEqual([1, 3]);
  expect([...new Float32Array(bytes(1))]).toEqual([1, -2, 3, 4, -1, 0]);
});

test("a rotation gets the sign nearer to the last one", () => {
  const out = new Float32Array(8);
  writeRotation(out, 0, Float64Array.of(1, 0, 0, 0), 0);
  writeRotation(out, 4, Float64Array.of(-2, 0.2, 0, 0), 0);
  expect(out[7]).toBeGreaterThan(0.99);
  expect(Math.hypot(...out.subarray(4))).toBeCloseTo(1, 6);
});
