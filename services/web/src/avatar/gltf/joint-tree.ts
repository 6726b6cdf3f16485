/** Joints of a glTF file as a tree with positions at rest. */
import { Matrix4, Quaternion, Vector3 } from "three";
import type { JointTree } from "../bone-names";
import { asList, asText, type JsonRecord } from "./json";
import type { GltfJson } from "./schema";

export interface NodeJoints extends JointTree {
  /** Index of each joint's node. */
  readonly nodes: readonly number[];
}

/**
 * Return the joints of the skins and what they hang from, parents first; all nodes, if there is no skin. `nodeParents`
 * are the parents of the nodes, -1 for roots; they must be a tree.
 */
export function collectJoints(json: GltfJson, nodeParents: readonly number[]): NodeJoints {
  const children = nodeParents.map((): number[] => []);
  const roots: number[] = [];
  nodeParents.forEach((parent, node) => {
    (parent < 0 ? roots : children[parent]).push(node);
  });
  const included = skinNodes(json, nodeParents);
  const nodes: number[] = [];
  const parents: number[] = [];
  const worlds: Matrix4[] = [];
  const pending = roots.toReversed().map((node) => ({ node, parent: -1 }));
  for (let next = pending.pop(); next; next = pending.pop()) {
    const { node, parent } = next;
    if (included.size > 0 && !included.has(node)) continue;
    const joint = nodes.push(node) - 1;
    parents.push(parent);
    const local = localMatrix(json.item("nodes", node));
    worlds.push(parent < 0 ? local : local.premultiply(worlds[parent]));
    for (const child of children[node].toReversed()) pending.push({ node: child, parent: joint });
  }
  return {
    nodes,
    parents,
    names: nodes.map((node) => asText(json.item("nodes", node).name) ?? ""),
    positions: worlds.map((world) => new Vector3().setFromMatrixPosition(world)),
  };
}

/** Return the nodes of the skins' joints and their ancestors. */
function skinNodes(json: GltfJson, parents: readonly number[]): Set<number> {
  const found = new Set<number>();
  json.list("skins").forEach((_, skin) => {
    for (const joint of asList(json.item("skins", skin).joints))
      for (let node = Number(joint); node >= 0 && !found.has(node); node = parents[node]) found.add(node);
  });
  return found;
}

function localMatrix({ matrix, translation, rotation, scale }: JsonRecord): Matrix4 {
  if (matrix) return new Matrix4().fromArray(matrix as number[]);
  return new Matrix4().compose(
    new Vector3().fromArray((translation as number[] | undefined) ?? [0, 0, 0]),
    new Quaternion().fromArray((rotation as number[] | undefined) ?? [0, 0, 0, 1]),
    new Vector3().fromArray((scale as number[] | undefined) ?? [1, 1, 1]),
  );
}
