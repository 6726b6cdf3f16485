import { describe, expect, test } from "vitest";
import { checkScene } from "../../../src/avatar/gltf/scene-check";
import { GltfJson } from "../../../src/avatar/gltf/schema";
import { type GltfFile, readFile } from "../compressed-files";
import { createFigureFile } from "../figure-files";

interface Nodes {
  nodes: Record<string, unknown>[];
  skins: Record<string, unknown>[];
  scenes: { nodes: number[] }[];
}
type Figure = GltfFile & Nodes;
type Change = (json: Figure) => void;

const { json: FIGURE } = readFile(createFigureFile({ dressed: true }));

/** Check the description of a figure after a change. */
function check(change: Change = () => {}): readonly number[] {
  const copy = structuredClone(FIGURE) as Figure;
  change(copy);
  return checkScene(new GltfJson(copy));
}

const primitive = (json: Figure) => json.meshes[0].primitives[0] as unknown as Record<string, unknown>;

describe("a scene", () => {
  test("of a figure passes, with the parents of its nodes", () => {
    const parents = check();
    const { nodes } = FIGURE as Figure;
    const child = (nodes[0].children as number[])[0];
    expect(parents).toHaveLength(nodes.length);
    expect(parents[child]).toBe(0);
  });

  test.each<[string, Change]>([
    ["nodes[0] is its own ancestor", ({ nodes }) => Object.assign(nodes, [{ children: [0] }], { length: 1 })],
    [
      "is its own ancestor",
      (json) => Object.assign(json, { nodes: [{ children: [1] }, { children: [2] }, { children: [0] }] }),
    ],
    ["node 1 has two parents", (json) => Object.assign(json, { nodes: [{ children: [1, 1] }, {}] })],
    ["nodes[0].children[0] refers to nodes 5", (json) => Object.assign(json, { nodes: [{ children: [5] }] })],
    ["nested more than 500 deep", (json) => Object.assign(json, { nodes: chain(600) })],
    ["nested more than 500 deep", (json) => Object.assign(json, { nodes: chain(600, -1), scenes: [] })],
    ["nodes: 30000", (json) => Object.assign(json, { nodes: Array.from({ length: 30_000 }, () => ({})) })],
    ["nodes[0].translation is", ({ nodes }) => (nodes[0].translation = [0, Number.POSITIVE_INFINITY, 0])],
    ["nodes[0].translation is", ({ nodes }) => (nodes[0].translation = ["a", 0, 0])],
    ["nodes[0].rotation is [0,0,0,4]", ({ nodes }) => (nodes[0].rotation = [0, 0, 0, 4])],
    ["nodes[0].matrix is", ({ nodes }) => (nodes[0].matrix = [1])],
    ["nodes[0].mesh refers to meshes 3", ({ nodes }) => (nodes[0].mesh = 3)],
    ["nodes[0].skin refers to skins 3", ({ nodes }) => (nodes[0].skin = 3)],
    [
      "nodes[0].extensions.EXT_mesh_gpu_instancing is not supported",
      ({ nodes }) => (nodes[0].extensions = { EXT_mesh_gpu_instancing: {} }),
    ],
    ["skins[0].joints[0] refers to nodes 9999", ({ skins }) => (skins[0].joints = [9999])],
    ["skins[0].joints is []", ({ skins }) => (skins[0].joints = [])],
    ["skins[0].joints reaches beyond", ({ skins }) => (skins[0].joints as number[]).push(0)],
    ["scenes[0].nodes[0] refers to nodes 9999", ({ scenes }) => (scenes[0].nodes = [9999])],
    ["scene is 4", (json) => (json.scene = 4)],
    ["meshes[0].primitives is missing", (json) => (json.meshes[0].primitives = [])],
    ["attributes.POSITION is missing", (json) => (primitive(json).attributes = {})],
    [
      "attributes.NORMAL refers to accessors 99",
      (json) => Object.assign(primitive(json).attributes as object, { NORMAL: 99 }),
    ],
    ["accessors[1].count is 5", (json) => (json.accessors[1].count = 5)],
    ["primitives[0].indices refers to accessors 99", (json) => (primitive(json).indices = 99)],
    ["primitives[0].material refers to materials 9", (json) => (primitive(json).material = 9)],
    [
      "primitives[0].targets: ",
      (json) => (primitive(json).targets = Array.from({ length: 100_000 }, () => ({ POSITION: 0 }))),
    ],
    [
      "baseColorTexture.index refers to textures 7",
      (json) => (json.materials = [{ pbrMetallicRoughness: { baseColorTexture: { index: 7 } } }]),
    ],
    ["textures[0].source refers to images 7", (json) => (json.textures = [{ source: 7 }])],
    ["images[0].bufferView is missing", (json) => (json.images = [{}])],
    ["external file skin.png", (json) => (json.images = [{ uri: "skin.png" }])],
    ["vertices in", (json) => json.nodes.push(...Array.from({ length: 10_000 }, () => ({ mesh: 0 })))],
  ])("is refused: %s", (message, change) => {
    expect(() => check(change)).toThrow(message);
  });
});

/** Return nodes in a chain, each above the next one, or the one before. */
function chain(length: number, step = 1): object[] {
  return Array.from({ length }, (_, node) => {
    const child = node + step;
    return child >= 0 && child < length ? { children: [child] } : {};
  });
}
