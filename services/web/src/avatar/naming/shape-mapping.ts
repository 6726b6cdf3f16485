/**
 * Mapping of a skeleton's joints to H-Anim joints by its shape alone. A body has two pairs of limbs, left and right
 * alike; each limb has two long bones in a row. The longer pair is the legs. The head is at the end of the longest
 * branch above the arms. Left and right follow from the feet, which point forwards, and from the knees.
 */
import { Vector3 } from "three";
import { ancestorChain, commonAncestor, isDescendant } from "./joint-tree";
import { ARM_JOINTS, LEG_JOINTS } from "./naming-profile";

/** Largest difference of left and right bones, as a share of the longer. */
const MAX_LENGTH_DIFFERENCE = 0.15;
/** Smallest limb, as a share of the longest one. */
const MIN_LIMB_RATIO = 0.2;
/** Bones shorter than this share of the median have no length: two joints at one place. */
const MAX_SHORT_RATIO = 0.01;
/** Longest bone of a limb, as a multiple of the other. */
const MAX_BONE_RATIO = 2;
/** Collar bone and upper arm are an arm only if upper arm and forearm are shorter than this share of them. */
const MAX_FOREARM_RATIO = 0.8;
/** Smallest extent of the head above its joint, as a share of a leg's length. */
const MIN_HEAD_RATIO = 0.12;
/** Smallest foot, as a share of a leg. */
const MIN_FOOT_RATIO = 0.05;
/** Number of limbs whose pairs are compared, the longest. */
const MAX_LIMBS = 60;
/** Agreement of hips and shoulders, as a cosine, below which the arms are exchanged. */
const MIN_ALIGNMENT = -0.3;
/** How far toes and knees are behind the legs, as a share of a thigh, from which on left and right are exchanged. */
const MIN_FORWARD = -0.1;

/** Joints of a skeleton; parents come before their children. */
export interface Skeleton {
  readonly parents: readonly number[];
  /** Positions at rest in the world frame. */
  readonly positions: readonly Vector3[];
}

interface Limb {
  readonly joints: readonly [number, number, number];
  readonly bones: readonly [number, number];
  readonly length: number;
}

type LimbPair = readonly [Limb, Limb];

/** Return the joints that the skeleton's shape gives; null if it does not have two pairs of limbs. */
export function mapByShape(skeleton: Skeleton): Map<string, number> | null {
  const { parents } = skeleton;
  const lengths = boneLengths(skeleton);
  const pairs = findLimbPairs(skeleton, lengths);
  const [legs] = pairs;
  const arms = legs && pairs.find((pair) => pair.every((arm) => legs.every((leg) => areDisjoint(arm, leg, parents))));
  if (!legs || !arms) return null;
  const joints = new Map<string, number>();
  const armPair = skipCollarBones(arms, pairs);
  for (const [at, side] of ["l", "r"].entries()) {
    const [leg, arm] = [legs[at], armPair[at]];
    for (const [k, name] of ["hip", "knee", "ankle"].entries()) joints.set(`${side}_${name}`, leg.joints[k]);
    for (const [k, name] of ["shoulder", "elbow", "wrist"].entries()) joints.set(`${side}_${name}`, arm.joints[k]);
    const [toes] = longestBranch(skeleton, lengths, leg.joints[2], new Set());
    if (toes !== undefined && lengths[toes] > MIN_FOOT_RATIO * leg.length) joints.set(`${side}_midtarsal`, toes);
  }
  resolveSides(skeleton.positions, joints);
  return joints;
}

/** Return the head's joint: the end of the longest branch that leaves the spine above the hips. */
export function findHead(skeleton: Skeleton, joints: ReadonlyMap<string, number>): number | undefined {
  const { parents } = skeleton;
  const lengths = boneLengths(skeleton);
  const found = (...names: string[]) => names.map((name) => joints.get(name)).filter((joint) => joint !== undefined);
  const arms = found("l_shoulder", "r_shoulder");
  const legs = found("l_hip", "r_hip");
  const [knee, ankle = knee] = found("l_knee", "l_ankle");
  if (arms.length < 2 || knee === undefined) return undefined;
  const leg = lengths[knee] + lengths[ankle];
  const chest = commonAncestor(parents, arms);
  const excluded = new Set([...arms, ...legs].flatMap((limb) => ancestorChain(parents, limb)));
  excluded.delete(chest);
  const branch = longestBranch(skeleton, lengths, chest, excluded);
  let above = 0;
  for (const joint of branch.toReversed()) {
    if (above >= MIN_HEAD_RATIO * leg) return joint;
    above += lengths[joint];
  }
  return branch.at(-1);
}

function boneLengths({ parents, positions }: Skeleton): number[] {
  return positions.map((position, joint) => (parents[joint] < 0 ? 0 : position.distanceTo(positions[parents[joint]])));
}

/** Return pairs of limbs that are alike and disjoint, longest first. */
function findLimbPairs(skeleton: Skeleton, lengths: readonly number[]): LimbPair[] {
  const limbs = findLimbs(skeleton, lengths)
    .sort((a, b) => b.length - a.length)
    .slice(0, MAX_LIMBS);
  const areAlike = (a: Limb, b: Limb) =>
    a.bones.every((bone, k) => Math.abs(bone - b.bones[k]) <= MAX_LENGTH_DIFFERENCE * Math.max(bone, b.bones[k]));
  const found = limbs.flatMap((a, at) =>
    limbs
      .slice(at + 1)
      .filter((b) => areAlike(a, b) && areDisjoint(a, b, skeleton.parents) && startAlike(a, b, skeleton))
      .map((b): LimbPair => [a, b]),
  );
  const shorter = ([a, b]: LimbPair) => Math.min(a.length, b.length);
  found.sort((a, b) => shorter(b) - shorter(a));
  return found.filter(([, b]) => b.length > MIN_LIMB_RATIO * found[0][0].length);
}

/** Return the arms one bone further down if they started with the collar bone, which a hand is too short for. */
function skipCollarBones(arms: LimbPair, pairs: readonly LimbPair[]): LimbPair {
  const total = (pair: LimbPair) => pair[0].length + pair[1].length;
  const key = (joints: readonly number[]) => joints.join();
  const lower = new Set(arms.map((arm) => key(arm.joints.slice(1))));
  const further = pairs.find(
    (pair) =>
      pair.every((arm) => lower.has(key(arm.joints.slice(0, 2)))) && total(pair) >= MAX_FOREARM_RATIO * total(arms),
  );
  return further ?? arms;
}

/** Return all pairs of consecutive bones, neither over twice the other; zero-length joints between are skipped. */
function findLimbs({ parents }: Skeleton, lengths: readonly number[]): Limb[] {
  const short = MAX_SHORT_RATIO * median(lengths.filter((length) => length > 0));
  return parents.flatMap((parent, end): Limb[] => {
    let middle = parent;
    if (middle < 0 || !(lengths[end] > short)) return [];
    while (lengths[middle] <= short && parents[middle] >= 0) middle = parents[middle];
    const start = parents[middle];
    const bones = [lengths[middle], lengths[end]] as const;
    if (start < 0 || Math.max(...bones) > MAX_BONE_RATIO * Math.min(...bones)) return [];
    return [{ joints: [start, middle, end], bones, length: bones[0] + bones[1] }];
  });
}

/** Return whether two limbs share no joint and neither is below the other. */
function areDisjoint(a: Limb, b: Limb, parents: readonly number[]): boolean {
  return (
    !a.joints.some((joint) => b.joints.includes(joint)) &&
    !isDescendant(parents, a.joints[0], b.joints[0]) &&
    !isDescendant(parents, b.joints[0], a.joints[0])
  );
}

/** Return whether two limbs start equally far from the joint at which they part, as a leg and a neck do not. */
function startAlike(a: Limb, b: Limb, { parents, positions }: Skeleton): boolean {
  const fork = commonAncestor(parents, [a.joints[0], b.joints[0]]);
  if (fork < 0) return false;
  const [first, second] = [a, b].map(({ joints }) => positions[joints[0]].distanceTo(positions[fork]));
  return Math.abs(first - second) <= MAX_LENGTH_DIFFERENCE * Math.max(a.length, b.length);
}

/** Return the joints below `start` along its longest branch, without those in `excluded`. */
function longestBranch(
  { parents }: Skeleton,
  lengths: readonly number[],
  start: number,
  excluded: ReadonlySet<number>,
): number[] {
  const reach = lengths.map(() => 0);
  const longest = new Map<number, number>();
  for (let joint = lengths.length - 1; joint >= 0; joint--) {
    const parent = parents[joint];
    const length = lengths[joint] + reach[joint];
    if (parent < 0 || excluded.has(joint) || (longest.has(parent) && length <= reach[parent])) continue;
    longest.set(parent, joint);
    reach[parent] = Math.max(reach[parent], length);
  }
  const branch: number[] = [];
  for (let joint = longest.get(start); joint !== undefined; joint = longest.get(joint)) branch.push(joint);
  return branch;
}

/** Exchange left and right where the body shows it: arms are above the legs of the same side, toes point forwards. */
function resolveSides(positions: readonly Vector3[], joints: Map<string, number>): void {
  const at = (name: string) => positions[joints.get(name) ?? 0];
  const between = (to: Vector3, from: Vector3) => new Vector3().subVectors(to, from);
  const centre = (joint: string) => new Vector3().lerpVectors(at(`l_${joint}`), at(`r_${joint}`), 0.5);
  const across = between(at("l_hip"), at("r_hip")).normalize();
  if (across.dot(between(at("l_shoulder"), at("r_shoulder")).normalize()) < MIN_ALIGNMENT)
    swapSides(joints, ARM_JOINTS);
  const trunk = between(centre("shoulder"), centre("hip")).normalize();
  const up = between(centre("hip"), centre("ankle")).normalize().add(trunk).normalize();
  const forward = new Vector3().crossVectors(across, up).normalize();
  let shown = 0;
  for (const side of ["l", "r"]) {
    const [hip, knee, ankle] = [at(`${side}_hip`), at(`${side}_knee`), at(`${side}_ankle`)];
    const thigh = hip.distanceTo(knee) || 1;
    shown += between(knee, hip.clone().add(ankle).multiplyScalar(0.5)).dot(forward) / thigh;
    if (joints.has(`${side}_midtarsal`)) shown += between(at(`${side}_midtarsal`), ankle).dot(forward) / thigh;
  }
  if (shown < MIN_FORWARD) swapSides(joints);
}

/** Exchange left and right of some joints, by default of all. */
export function swapSides(
  joints: Map<string, number>,
  names: readonly string[] = [...LEG_JOINTS, ...ARM_JOINTS],
): void {
  for (const name of names) {
    const [left, right] = [joints.get(`l_${name}`), joints.get(`r_${name}`)];
    joints.delete(`l_${name}`);
    joints.delete(`r_${name}`);
    if (right !== undefined) joints.set(`l_${name}`, right);
    if (left !== undefined) joints.set(`r_${name}`, left);
  }
}

function median(values: readonly number[]): number {
  const sorted = values.toSorted((a, b) => a - b);
  const middle = sorted.length >> 1;
  return sorted.length % 2 === 1 ? sorted[middle] : ((sorted[middle - 1] ?? 0) + (sorted[middle] ?? 0)) / 2;
}
