import { describe, expect, test } from "vitest";
import { findCompressions } from "../../../src/avatar/gltf/compression";
import { parseContainer } from "../../../src/avatar/gltf/container";
import { asRecord } from "../../../src/avatar/gltf/json";
import { GltfJson } from "../../../src/avatar/gltf/schema";
import { compressByDraco, compressByMeshopt, type GltfFile, withTexture } from "../compressed-files";
import { createFigureFile } from "../figure-files";
import { ETC1S_TEXTURE } from "../textures";

const DRACO = await compressByDraco(createFigureFile());

/** Return the compressions of a file, after a change of its description or its data. */
function compressionsOf(
  file: Uint8Array<ArrayBuffer>,
  change: (json: GltfFile, binary: Uint8Array) => void = () => {},
): string[] {
  const { json, binary } = parseContainer(file.slice().buffer);
  change(json as GltfFile, binary ?? new Uint8Array());
  return [...findCompressions(new GltfJson(asRecord(json)), binary ?? new Uint8Array())];
}

describe("compressions", () => {
  test("are found in the parts of a file", async () => {
    expect(compressionsOf(createFigureFile({ dressed: true }))).toEqual([]);
    expect(compressionsOf(DRACO)).toEqual(["Draco"]);
    const both = withTexture(createFigureFile({ dressed: true }), ETC1S_TEXTURE);
    expect(compressionsOf(both)).toEqual(["KTX2"]);
    expect(compressionsOf(await compressByMeshopt(both))).toEqual(["meshopt", "KTX2"]);
  });

  test("by Draco to more than the accessors say are refused", () => {
    const fewer = (json: GltfFile) => {
      json.accessors[json.meshes[0].primitives[0].indices].count = 3;
    };
    expect(() => compressionsOf(DRACO, fewer)).toThrow("num_faces");
    const smaller = (json: GltfFile) => {
      json.accessors[json.meshes[0].primitives[0].attributes.POSITION].count = 3;
    };
    expect(() => compressionsOf(DRACO, smaller)).toThrow("num_points");
  });

  test.each<[string, number, number]>([
    ["is not Draco data", 0, 0],
    ["version", 5, 1],
    ["encoder_type", 7, 0],
    ["flags", 10, 0x80],
  ])("by Draco with another header are refused: %s", (message, at, value) => {
    const change = (json: GltfFile, binary: Uint8Array) => {
      binary[(json.bufferViews.at(-1)?.byteOffset ?? 0) + at] = value;
    };
    expect(() => compressionsOf(DRACO, change)).toThrow(message);
  });

  test("by Draco that end early are refused", () => {
    const change = (json: GltfFile) => Object.assign(json.bufferViews.at(-1) ?? {}, { byteLength: 13 });
    expect(() => compressionsOf(DRACO, change)).toThrow("reaches beyond the end");
  });

  test("of many large textures are refused", () => {
    const file = withTexture(createFigureFile({ dressed: true }), ETC1S_TEXTURE);
    const change = (json: GltfFile, binary: Uint8Array) => {
      const [{ bufferView }] = json.images as { bufferView: number }[];
      const view = new DataView(binary.buffer, binary.byteOffset + (json.bufferViews[bufferView].byteOffset ?? 0));
      view.setUint32(20, 8192, true);
      view.setUint32(24, 8192, true);
      json.images = [0, 1, 2].map(() => ({ bufferView }));
      json.textures = [0, 1, 2].map((source) => ({ extensions: { KHR_texture_basisu: { source } } }));
    };
    expect(() => compressionsOf(file, change)).toThrow("images[1]: 537 MB; the limit is 512 MB");
  });
});
