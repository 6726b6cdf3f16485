import { Object3D } from "three";
import { expect, test } from "vitest";
import { findTrunkBones } from "../../src/avatar/trunk-bones";

/** Return the nodes of a body whose spine has `trunk` further bones, with neck and shoulders or without. */
function body(trunk: number, carriers = true): Map<string, Object3D> {
  const nodes = new Map<string, Object3D>();
  const add = (name: string, parent: Object3D | null): Object3D => {
    const node = new Object3D();
    node.name = name;
    parent?.add(node);
    nodes.set(name, node);
    return node;
  };
  let chest = add("spine", add("hips", null));
  for (let bone = 0; bone < trunk; bone++) chest = add(`trunk${bone}`, chest);
  add("head", carriers ? add("anyNeck", chest) : chest);
  for (const side of ["left", "right"]) add(`${side}UpperArm`, carriers ? add(`${side}Any`, chest) : chest);
  return nodes;
}

const namesOf = (nodes: Map<string, Object3D>) => [...findTrunkBones(nodes)].map(([bone, node]) => [bone, node.name]);
const CARRIERS = [
  ["neck", "anyNeck"],
  ["leftShoulder", "leftAny"],
  ["rightShoulder", "rightAny"],
];

test.each([
  [0, []],
  [1, [["chest", "trunk0"]]],
  [
    2,
    [
      ["chest", "trunk0"],
      ["upperChest", "trunk1"],
    ],
  ],
  [
    4,
    [
      ["chest", "trunk0"],
      ["upperChest", "trunk3"],
    ],
  ],
])("a spine with %i further bones", (trunk, expected) => {
  expect(namesOf(body(trunk))).toEqual([...expected, ...CARRIERS]);
});

test("a body whose arms and head hang from the spine has no further bones", () => {
  expect(namesOf(body(0, false))).toEqual([]);
});

test("arms that do not hang from the spine give no bones", () => {
  const nodes = body(1);
  (nodes.get("hips") as Object3D).add(nodes.get("leftAny") as Object3D);
  expect(namesOf(nodes)).toEqual([]);
});
