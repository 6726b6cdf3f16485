/** Bones of an avatar's trunk that an extension moves: chest, neck and shoulders, found by their place in the tree. */
import type { Object3D } from "three";
import { TRUNK_BONES } from "../motion/extended-humanoid";

/** Return the nodes of chest, upper chest, neck and shoulders, as far as the file has them. */
export function findTrunkBones(nodes: ReadonlyMap<string, Object3D>): Map<string, Object3D> {
  const node = (bone: string) => nodes.get(bone) as Object3D;
  const found = new Map<string, Object3D>();
  const arms = [node("leftUpperArm"), node("rightUpperArm")];
  const chest = commonAncestor(arms[0], arms[1]);
  const spine = node("spine");
  if (!spine || !chest || (chest !== spine && !isBelow(chest, spine))) return found;
  const trunk = chest === spine ? [] : [...between(spine, chest), chest];
  // Of more bones than a humanoid has, those in between rest.
  const named = trunk.length > 2 ? [trunk[0], trunk[trunk.length - 1]] : trunk;
  named.forEach((bone, at) => found.set(TRUNK_BONES[at + 1], bone));
  const add = (bone: string, carried: Object3D | undefined) => {
    const [first] = carried && isBelow(carried, chest) ? between(chest, carried) : [];
    if (first) found.set(bone, first);
  };
  add("neck", nodes.get("head"));
  add("leftShoulder", arms[0]);
  add("rightShoulder", arms[1]);
  return found;
}

function isBelow(node: Object3D, ancestor: Object3D): boolean {
  for (let above = node.parent; above; above = above.parent) if (above === ancestor) return true;
  return false;
}

/** Return the nodes between a node and its ancestor, from above. */
function between(ancestor: Object3D, node: Object3D): Object3D[] {
  const nodes: Object3D[] = [];
  for (let above = node.parent; above && above !== ancestor; above = above.parent) nodes.unshift(above);
  return nodes;
}

function commonAncestor(a: Object3D, b: Object3D): Object3D | null {
  for (let above = a.parent; above; above = above.parent) if (isBelow(b, above)) return above;
  return null;
}
