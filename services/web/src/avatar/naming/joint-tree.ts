/** Trees of joints, given as the parent of each joint, -1 for the root; parents come before their children. */

/** Return `joint` and its ancestors up to the root. */
export function ancestorChain(parents: readonly number[], joint: number): number[] {
  const chain: number[] = [];
  for (let at = joint; at >= 0; at = parents[at]) chain.push(at);
  return chain;
}

/** Return whether `joint` is below `ancestor`, at any depth. */
export function isDescendant(parents: readonly number[], joint: number, ancestor: number): boolean {
  for (let at = joint >= 0 ? parents[joint] : -1; at >= 0; at = parents[at]) if (at === ancestor) return true;
  return false;
}

/** Return the lowest joint that is, or is above, all of `joints`; -1 if they are in different trees. */
export function commonAncestor(parents: readonly number[], joints: readonly number[]): number {
  const [first, ...others] = joints.map((joint) => ancestorChain(parents, joint));
  return first.find((joint) => others.every((chain) => chain.includes(joint))) ?? -1;
}
