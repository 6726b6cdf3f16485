import { describe, expect, test } from "vitest";
import { collectJoints } from "../../../src/avatar/gltf/joint-tree";
import { checkScene } from "../../../src/avatar/gltf/scene-check";
import { GltfJson } from "../../../src/avatar/gltf/schema";

/** Return the joints of nodes; `joints` are those of a skin. */
function jointsOf(nodes: object[], joints?: number[]) {
  const json = new GltfJson({ nodes, ...(joints ? { skins: [{ joints }] } : {}) });
  return collectJoints(json, checkScene(json));
}

describe("joints of a file", () => {
  const nodes = [
    { name: "hand", translation: [0, 1, 0] },
    { name: "arm", children: [0], translation: [1, 0, 0], rotation: [0, 0, Math.SQRT1_2, Math.SQRT1_2] },
    { name: "mesh" },
    { name: "root", children: [2, 1], scale: [2, 2, 2] },
    { matrix: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1] },
  ];

  test("are in the order of the tree, with positions in the world", () => {
    const { names, parents, positions, nodes: indices } = jointsOf(nodes);
    expect(names).toEqual(["root", "arm", "hand", "mesh", ""]);
    expect(parents).toEqual([-1, 0, 1, 0, -1]);
    expect(indices).toEqual([3, 1, 0, 2, 4]);
    const rounded = positions.map((position) => position.toArray().map((value) => Math.round(value * 1e6) / 1e6 + 0));
    expect(rounded.slice(1)).toEqual([
      [2, 0, 0],
      [0, 0, 0],
      [0, 0, 0],
      [5, 6, 7],
    ]);
  });

  test("are those of the skins and what they hang from", () => {
    expect(jointsOf(nodes, [0]).names).toEqual(["root", "arm", "hand"]);
  });
});
