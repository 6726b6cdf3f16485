import { describe, expect, test } from "vitest";
import { checkData, MAX_DATA_BYTES } from "../../../src/avatar/gltf/data-check";
import { GltfJson } from "../../../src/avatar/gltf/schema";
import { compressByMeshopt, type GltfFile, readFile } from "../compressed-files";
import { createFigureFile } from "../figure-files";

type Change = (json: GltfFile) => void;

const FIGURE = readFile(createFigureFile());
const COMPRESSED = readFile(await compressByMeshopt(createFigureFile()));
const lengthOf = ({ buffers }: GltfFile) => Number(buffers[0].byteLength);

/** Check the description of a figure after a change. */
function check({ json }: { json: GltfFile }, change: Change = () => {}): void {
  const copy = structuredClone(json);
  change(copy);
  checkData(new GltfJson(copy), lengthOf(json));
}

const meshopt = (json: GltfFile) => json.bufferViews[0].extensions?.EXT_meshopt_compression as Record<string, unknown>;

describe("binary data", () => {
  test("of figures pass", () => {
    expect(() => check(FIGURE)).not.toThrow();
    expect(() => check(COMPRESSED)).not.toThrow();
  });

  test.each<[string, Change]>([
    ["buffers[0].byteLength reaches beyond the end of the file", (json) => (json.buffers[0].byteLength = 1e9)],
    ["buffers[0].byteLength is missing", (json) => delete json.buffers[0].byteLength],
    ["it refers to the external file body.bin", (json) => (json.buffers[0].uri = "body.bin")],
    ["buffers[1].uri is missing", (json) => json.buffers.push({ byteLength: 4 })],
    ["bufferViews[0].buffer refers to buffers 3", (json) => (json.bufferViews[0].buffer = 3)],
    ["bufferViews[0] reaches beyond the end of buffers[0]", (json) => (json.bufferViews[0].byteLength = 1e9)],
    ["bufferViews[0].byteOffset is -4", (json) => (json.bufferViews[0].byteOffset = -4)],
    ["accessors[0] reaches beyond the end of bufferViews[0]", (json) => (json.accessors[0].count *= 2)],
    ["accessors[0].count is 0", (json) => (json.accessors[0].count = 0)],
    ["accessors[0].count: ", (json) => Object.assign(json.accessors[0], { count: 2 ** 40, bufferView: undefined })],
    ["accessors[0].componentType is 7", (json) => (json.accessors[0].componentType = 7)],
    ['accessors[0].type is "toString"', (json) => (json.accessors[0].type = "toString")],
    ["accessors[0].bufferView refers to bufferViews 99", (json) => (json.accessors[0].bufferView = 99)],
    [
      "accessors[0].sparse.count is 1000000",
      (json) => Object.assign(json.accessors[0], { sparse: { count: 1e6, indices: {}, values: {} } }),
    ],
    [
      "accessors[0].sparse.indices.componentType is missing",
      (json) => Object.assign(json.accessors[0], { sparse: { count: 1, indices: {}, values: {} } }),
    ],
  ])("are refused: %s", (message, change) => {
    expect(() => check(FIGURE, change)).toThrow(message);
  });

  test.each<[string, Change]>([
    ["EXT_meshopt_compression.count is 1000000", (json) => (meshopt(json).count = 1e6)],
    ["EXT_meshopt_compression.byteStride is 6", (json) => (meshopt(json).byteStride = 6)],
    ["EXT_meshopt_compression.buffer refers to buffers 9", (json) => (meshopt(json).buffer = 9)],
    ["EXT_meshopt_compression reaches beyond the end of buffers[0]", (json) => (meshopt(json).byteLength = 1e9)],
    ['EXT_meshopt_compression.mode is "FOO"', (json) => (meshopt(json).mode = "FOO")],
    ['EXT_meshopt_compression.filter is "FOO"', (json) => (meshopt(json).filter = "FOO")],
    ["bufferViews[0].buffer is 1", (json) => delete json.bufferViews[0].extensions],
    [
      "bufferViews[0]: ",
      (json) => {
        const count = MAX_DATA_BYTES / 4;
        json.buffers[1].byteLength = 8 * count;
        Object.assign(json.bufferViews[0], { byteOffset: 0, byteLength: 8 * count });
        Object.assign(meshopt(json), { count, byteStride: 8 });
      },
    ],
  ])("compressed by meshopt are refused: %s", (message, change) => {
    expect(() => check(COMPRESSED, change)).toThrow(message);
  });
});
