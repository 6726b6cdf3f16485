/**
 * Assignment of the joints of a plain glTF file to humanoid bones: by the names that common tools use, otherwise by the
 * skeleton's shape.
 */
import type { Vector3 } from "three";
import { FINGERS, VRM_NAMES } from "../motion/hands";
import { findFingers } from "./hands/finger-names";
import { splitWords } from "./naming/joint-name";
import { ancestorChain, commonAncestor } from "./naming/joint-tree";
import { findHeadByName, mapByName, mapPartly } from "./naming/name-mapping";
import { SIDE_WORDS } from "./naming/naming-profile";
import { findHead, mapByShape, swapSides } from "./naming/shape-mapping";

/** Joints of a file; parents come before their children. */
export interface JointTree {
  readonly names: readonly string[];
  /** Parent of each joint, -1 for a root. */
  readonly parents: readonly number[];
  /** Positions at rest in the world frame. */
  readonly positions: readonly Vector3[];
}

/** Bones that an avatar must have: those that the stream moves, except the toes. VRM requires the same. */
export const REQUIRED_BONES: readonly string[] = [
  "hips",
  "spine",
  "head",
  "leftUpperArm",
  "leftLowerArm",
  "leftHand",
  "rightUpperArm",
  "rightLowerArm",
  "rightHand",
  "leftUpperLeg",
  "leftLowerLeg",
  "leftFoot",
  "rightUpperLeg",
  "rightLowerLeg",
  "rightFoot",
];

/** Bones of a side by H-Anim joint. */
const LIMB_BONES: Readonly<Record<string, string>> = {
  shoulder: "UpperArm",
  elbow: "LowerArm",
  wrist: "Hand",
  hip: "UpperLeg",
  knee: "LowerLeg",
  ankle: "Foot",
  midtarsal: "Toes",
};
const SIDES = { l: "left", r: "right" } as const;

/**
 * Return the index of each bone found, by VRM bone name. If arms or legs are named, but some of their joints missing,
 * only those that are named are returned: a shape without them is another body's.
 */
export function findBones(tree: JointTree): Map<string, number> {
  const { names, parents } = tree;
  const named = mapByName(names, parents)?.joints;
  const partial = named ? null : mapPartly(names, parents);
  const joints = named ?? (partial?.size ? partial : shapedJoints(tree));
  if (!joints) return new Map();
  const head = joints.get("skullbase") ?? findHeadByName(names, parents, joints) ?? findHead(tree, joints);
  const bones = new Map<string, number>();
  for (const [index, [letter, side]] of Object.entries(SIDES).entries()) {
    for (const [joint, bone] of Object.entries(LIMB_BONES)) {
      const found = joints.get(`${letter}_${joint}`) ?? endOfLimb(tree, joints, letter, joint);
      if (found !== undefined) bones.set(side + bone, found);
    }
    const hand = bones.get(`${side}Hand`);
    if (hand === undefined) continue;
    findFingers(names, parents, hand).forEach((chain, finger) => {
      const bonesOfFinger = VRM_NAMES[index * FINGERS.length + finger];
      chain.forEach((found, place) => bones.set(bonesOfFinger[place], found));
    });
  }
  if (head !== undefined) bones.set("head", head);
  addTrunk(parents, bones);
  return bones;
}

/**
 * Return the joints that the shape gives; null if it gives none. Left and right are those in the joints' names, if they
 * have any; else those of the feet; without feet, the file faces z as glTF demands (glTF 2.0, 3.4).
 */
function shapedJoints(tree: JointTree): ReadonlyMap<string, number> | null {
  const joints = mapByShape(tree);
  if (!joints) return null;
  const limbs = [...joints].filter(([joint]) => /^[lr]_/.test(joint));
  let agreement = 0;
  for (const [joint, index] of limbs) {
    const words = splitWords(tree.names[index]);
    const side = [0, 1].find((at) => SIDE_WORDS.some((pair) => words.includes(pair[at])));
    if (side !== undefined) agreement += side === "lr".indexOf(joint[0]) ? 1 : -1;
  }
  if (agreement === 0 && !joints.has("l_midtarsal"))
    for (const [joint, index] of limbs) agreement += (joint[0] === "l" ? 1 : -1) * tree.positions[index].x;
  if (agreement < 0) swapSides(joints);
  return joints;
}

/** Return the missing required bones in plain words: "left lower arm". */
export function missingBones(bones: ReadonlyMap<string, unknown>): string[] {
  return REQUIRED_BONES.filter((bone) => !bones.has(bone)).map((bone) =>
    bone.replace(/[A-Z]/g, (letter) => ` ${letter.toLowerCase()}`),
  );
}

/** Words of joints that share a limb's twist and end nothing. */
const TWIST_WORDS = ["twist", "roll"];

/** Return the only joint directly below knee or elbow, which ends a limb whatever its name; undefined otherwise. */
function endOfLimb(
  { names, parents }: JointTree,
  joints: ReadonlyMap<string, number>,
  side: string,
  joint: string,
): number | undefined {
  const above = { ankle: "knee", wrist: "elbow" }[joint];
  const start = above && joints.get(`${side}_${above}`);
  if (start === undefined) return undefined;
  const children = parents.flatMap((parent, child) => (parent === start ? [child] : []));
  if (children.length !== 1 || splitWords(names[children[0]]).some((word) => TWIST_WORDS.includes(word)))
    return undefined;
  return children[0];
}

/**
 * Add hips and spine: the joint where legs and trunk separate, whatever its name, and the next one towards arms and
 * head.
 */
function addTrunk(parents: readonly number[], bones: Map<string, number>): void {
  const indices = (...names: string[]) => names.map((name) => bones.get(name)).filter((joint) => joint !== undefined);
  const legs = indices("leftUpperLeg", "rightUpperLeg");
  const upper = indices("leftUpperArm", "rightUpperArm", "head");
  if (legs.length === 0 || upper.length === 0) return;
  const chest = commonAncestor(parents, upper);
  const root = commonAncestor(parents, [...legs, ...upper]);
  if (root < 0) return;
  const limbs = new Set([...legs, ...upper]);
  // A chest that is the root itself leaves no joint for the spine.
  const path = ancestorChain(parents, chest);
  const spine = path.slice(0, path.indexOf(root)).at(-1);
  bones.set("hips", root);
  if (spine !== undefined && !limbs.has(spine)) bones.set("spine", spine);
}
