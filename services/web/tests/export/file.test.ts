import { expect, test } from "vitest";
import { makeFile, type Format } from "../../src/export/file";
import { BlockStore } from "../../src/playout/blocks";
import { puppetModel } from "../../src/stage/model";
import { type BlockVectors, goldenTrack } from "../golden";
import { bytes, vectors } from "../vectors";

const store = new BlockStore(goldenTrack());
[0, 0, 1, 2].forEach((index, nth) => store.put(index, nth, bytes(vectors<BlockVectors>("blocks").valid[nth].block)));
// eight bytes that stand for a picture
const picture = Uint8Array.of(0x89, 0x50, 0x4e, 0x47, 13, 10, 26, 10);
const looks = { model: puppetModel, face: async () => picture };

test.each([["bvh", "HIERARCHY"], ["glb", "glTF"], ["vrma", "glTF"]] as const)("a dance as %s", async (format, beginning) => {
  const shares: number[] = [];
  const file = await makeFile(format, "a dance", store, { looks, told: (share) => shares.push(share) });
  expect((await file.text()).startsWith(beginning)).toBe(true);
  expect(shares).toEqual([...shares].sort((a, b) => a - b));
});

test("the puppet's face is in its GLB", async () => {
  const file = Buffer.from(await (await makeFile("glb", "a dance", store, { looks })).arrayBuffer());
  const json = JSON.parse(file.subarray(20, 20 + file.readUInt32LE(12)).toString()) as { images: { bufferView: number }[]; bufferViews: { byteOffset: number; byteLength: number }[] };
  const { byteOffset, byteLength } = json.bufferViews[json.images[0].bufferView];
  const buffer = file.subarray(20 + file.readUInt32LE(12) + 8);
  expect([...buffer.subarray(byteOffset, byteOffset + byteLength)]).toEqual([...picture]);
});

test("what is given up is not made", async () => {
  const reason = new Error("given up");
  for (const format of ["bvh", "glb", "vrma"] satisfies Format[]) {
    await expect(makeFile(format, "a dance", store, { looks, signal: AbortSignal.abort(reason) })).rejects.toBe(reason);
  }
});
