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

test("a rotation gets the sign nearer to the last one", () => {
  const out = new Float32Array(8);
  writeRotation(out, 0, Float64Array.of(1, 0, 0, 0), 0);
  writeRotation(out, 4, Float64Array.of(-2, 0.2, 0, 0), 0);
  expect(out[7]).toBeGreaterThan(0.99);
  expect(Math.hypot(...out.subarray(4))).toBeCloseTo(1, 6);
});
