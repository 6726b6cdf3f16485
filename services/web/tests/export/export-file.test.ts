import { expect, test } from "vitest";
import { type ExportFormat, exportFile } from "../../src/export/export-file";
import type { Figure } from "../../src/motion/skeleton";
import { createPuppetModel } from "../../src/stage/puppet/puppet-model";
import { goldenStore } from "./motions";

const source = { store: goldenStore(), frames: 78 };
/** A second dancer, cut where the first is done. */
const second = { store: goldenStore(1, { x: 1, z: 0, turn: 0.5 }), frames: 40 };
// eight bytes that stand for a picture
const picture = Uint8Array.of(0x89, 0x50, 0x4e, 0x47, 13, 10, 26, 10);
const looks = { createModel: createPuppetModel, renderFacePng: async () => picture };

test.each([
  ["bvh", "HIERARCHY"],
  ["glb", "glTF"],
  ["vrma", "glTF"],
] as const)("a dance as %s", async (format, beginning) => {
  const shares: number[] = [];
  const file = await exportFile(format, "a dance", [source], {
    puppets: looks,
    onProgress: (share) => shares.push(share),
  });
  expect((await file.text()).startsWith(beginning)).toBe(true);
  expect(shares).toEqual([...shares].sort((a, b) => a - b));
});

test("the puppet's face is in its GLB", async () => {
  const file = Buffer.from(await (await exportFile("glb", "a dance", [source], { puppets: looks })).arrayBuffer());
  const json = jsonOf(file);
  const { byteOffset, byteLength } = json.bufferViews[json.images[0].bufferView];
  const buffer = file.subarray(20 + file.readUInt32LE(12) + 8);
  expect([...buffer.subarray(byteOffset, byteOffset + byteLength)]).toEqual([...picture]);
});

test("of several dancers all are in one GLB, those of equal lengths with one mesh, and each as long as it is danced", async () => {
  const made: unknown[] = [];
  const shares: number[] = [];
  const counting = { ...looks, createModel: (figure: Figure) => (made.push(figure), createPuppetModel(figure)) };
  const again = { store: goldenStore(0, { x: -1, z: 0, turn: 0 }), frames: 78 };
  const file = await exportFile("glb", "a dance", [source, second, again], {
    puppets: counting,
    onProgress: (share) => shares.push(share),
  });
  const json = jsonOf(Buffer.from(await file.arrayBuffer()));
  expect([made.length, json.meshes.length, json.skins.length]).toEqual([2, 2, 3]);
  expect(json.nodes.filter(({ name }) => name.startsWith("dancer")).map(({ name }) => name)).toEqual([
    "dancer 1",
    "dancer 2",
    "dancer 3",
  ]);
  const times = new Set(json.animations[0].samplers.map(({ input }) => json.accessors[input].count));
  expect([...times]).toEqual([78, 40]);
  expect(shares).toEqual([...shares].sort((a, b) => a - b));
});

test("what is given up is not made", async () => {
  const reason = new Error("given up");
  for (const format of ["bvh", "glb", "vrma"] satisfies ExportFormat[]) {
    await expect(
      exportFile(format, "a dance", [source], { puppets: looks, signal: AbortSignal.abort(reason) }),
    ).rejects.toBe(reason);
  }
});

interface Described {
  nodes: { name: string }[];
  meshes: unknown[];
  skins: unknown[];
  animations: { samplers: { input: number }[] }[];
  accessors: { count: number }[];
  images: { bufferView: number }[];
  bufferViews: { byteOffset: number; byteLength: number }[];
}

/** What a GLB says of itself. */
function jsonOf(file: Buffer): Described {
  return JSON.parse(file.subarray(20, 20 + file.readUInt32LE(12)).toString()) as Described;
}
