import { expect, test } from "vitest";
import { type ExportFormat, exportFile } from "../../src/export/export-file";
import { PROP_FORMS } from "../../src/motion/props";
import type { Figure } from "../../src/motion/skeleton";
import { PropBlockStore } from "../../src/playout/prop-store";
import { createPropShape } from "../../src/stage/props/prop-shape";
import { createPuppetModel } from "../../src/stage/puppet/puppet-model";
import { goldenPropTracks, propVectors } from "../golden-props";
import { decodeBase64 } from "../golden-vectors";
import { goldenStore } from "./motions";

const source = { store: goldenStore(), frames: 78 };
/** A second performer, cut at the end of the first. */
const second = { store: goldenStore(1, { x: 1, z: 0, turn: 0.5 }), frames: 40 };
// Eight bytes that stand for an image.
const picture = Uint8Array.of(0x89, 0x50, 0x4e, 0x47, 13, 10, 26, 10);
const puppets = { createModel: createPuppetModel, renderFacePng: async () => picture };

test.each([
  ["bvh", "HIERARCHY"],
  ["glb", "glTF"],
  ["vrma", "glTF"],
] as const)("a motion is exported as %s", async (format, beginning) => {
  const shares: number[] = [];
  const file = await exportFile(format, "a dance", [source], {
    puppets,
    onProgress: (share) => shares.push(share),
  });
  expect((await file.text()).startsWith(beginning)).toBe(true);
  expect(shares).toEqual([...shares].sort((a, b) => a - b));
});

test("the puppet's face texture is in its GLB", async () => {
  const file = Buffer.from(await (await exportFile("glb", "a dance", [source], { puppets })).arrayBuffer());
  const json = jsonOf(file);
  const { byteOffset, byteLength } = json.bufferViews[json.images[0].bufferView];
  const buffer = file.subarray(20 + file.readUInt32LE(12) + 8);
  expect([...buffer.subarray(byteOffset, byteOffset + byteLength)]).toEqual([...picture]);
});

test("one GLB holds several performers, with a mesh per figure", async () => {
  const figures: unknown[] = [];
  const shares: number[] = [];
  const counting = { ...puppets, createModel: (figure: Figure) => (figures.push(figure), createPuppetModel(figure)) };
  const again = { store: goldenStore(0, { x: -1, z: 0, turn: 0 }), frames: 78 };
  const file = await exportFile("glb", "a dance", [source, second, again], {
    puppets: counting,
    onProgress: (share) => shares.push(share),
  });
  const json = jsonOf(Buffer.from(await file.arrayBuffer()));
  expect([figures.length, json.meshes.length, json.skins.length]).toEqual([2, 2, 3]);
  expect(json.nodes.filter(({ name }) => name.startsWith("dancer")).map(({ name }) => name)).toEqual([
    "dancer 1",
    "dancer 2",
    "dancer 3",
  ]);
  const times = new Set(json.animations[0].samplers.map(({ input }) => json.accessors[input].count));
  expect([...times]).toEqual([78, 40]);
  expect(shares).toEqual([...shares].sort((a, b) => a - b));
});

test("an aborted export is not made", async () => {
  const reason = new Error("given up");
  for (const format of ["bvh", "glb", "vrma"] satisfies ExportFormat[]) {
    await expect(exportFile(format, "a dance", [source], { puppets, signal: AbortSignal.abort(reason) })).rejects.toBe(
      reason,
    );
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

/** Return the JSON chunk of a GLB. */
function jsonOf(file: Buffer): Described {
  return JSON.parse(file.subarray(20, 20 + file.readUInt32LE(12)).toString()) as Described;
}

test("a GLB has the props of the motion, other formats do not", async () => {
  const stores = [new PropBlockStore(goldenPropTracks()[0])];
  for (const { index, block } of propVectors().valid.filter(({ track }) => track === 0))
    stores[0].put(index, 0, decodeBase64(block));
  const models = new Map([["fan", { name: "fan", form: PROP_FORMS.fan, shape: createPropShape("fan") }]]);
  const props = { stores, performers: [0], models };
  const nodesOf = async (format: ExportFormat) => {
    const file = await exportFile(format, "a dance", [source], { puppets, props });
    return jsonOf(Buffer.from(await file.arrayBuffer())).nodes.map(({ name }) => name);
  };
  expect((await nodesOf("glb")).filter((name) => name.startsWith("prop"))).toEqual(["prop 1 fan"]);
  expect((await nodesOf("vrma")).filter((name) => name.startsWith("prop"))).toEqual([]);
});
