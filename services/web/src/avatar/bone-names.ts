/** Assignment of the nodes of a plain glTF file to humanoid bones, by the names that common tools use. Pure. */

/** A node's name in the file, and the index of its parent; -1 for a root. */
export interface NamedNode {
  name: string;
  parent: number;
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

/** Words for a bone, the likeliest first, without side, case, numbers and separators. */
type BoneWords = Readonly<Record<string, readonly string[]>>;

const CENTRE_WORDS: BoneWords = {
  hips: ["hips", "pelvis", "humanoidroot", "hip"],
  spine: ["spine", "vl5", "abdomen", "torso", "waist", "chest"],
  head: ["head", "skullbase", "skull"],
};

const COMMON_WORDS: BoneWords = {
  UpperArm: ["upperarm", "uparm"],
  LowerArm: ["lowerarm", "forearm"],
  Hand: ["hand"],
  MiddleProximal: ["middleproximal", "handmiddle", "middle", "fmiddle"],
  UpperLeg: ["upperleg", "upleg", "thigh"],
  LowerLeg: ["lowerleg", "calf", "shin"],
  Foot: ["foot"],
  Toes: ["toebase", "toes", "toe", "ball"],
};

/** Words for the limbs: the same word is the upper arm in one naming scheme and the collar bone in another. */
const NAMING_SCHEMES: readonly BoneWords[] = [
  // VRoid, Unreal, Unity, 3ds Max, Blender.
  COMMON_WORDS,
  // Mixamo.
  { ...COMMON_WORDS, UpperArm: ["arm"], LowerLeg: ["leg"] },
  // H-Anim, and others that name joints instead of bones.
  {
    ...COMMON_WORDS,
    UpperArm: ["shoulder"],
    LowerArm: ["elbow"],
    Hand: ["wrist"],
    UpperLeg: ["hip"],
    LowerLeg: ["knee"],
    Foot: ["ankle"],
    Toes: ["midtarsal", "toebase", "toes", "toe", "ball"],
  },
  // Tools of VRChat.
  {
    ...COMMON_WORDS,
    UpperArm: ["arm"],
    LowerArm: ["elbow"],
    Hand: ["wrist"],
    UpperLeg: ["leg"],
    LowerLeg: ["knee"],
    Foot: ["ankle"],
  },
];

/** Ancestor of each bone, at any depth. */
const PARENT_BONE: Readonly<Record<string, string>> = {
  spine: "hips",
  head: "spine",
  UpperArm: "spine",
  LowerArm: "UpperArm",
  Hand: "LowerArm",
  MiddleProximal: "Hand",
  UpperLeg: "hips",
  LowerLeg: "UpperLeg",
  Foot: "LowerLeg",
  Toes: "Foot",
};

/** Words that name the tool or the skeleton, not the bone. */
const NOISE_PATTERN =
  /^(mixamorig|bip|valvebiped|hanim|def|org|armature|character|skeleton|rig|cc|base|j|jnt|joint|bone|c|center|b)\d*$/;
const SIDES: Readonly<Record<string, Side>> = { l: "left", left: "left", r: "right", right: "right" };

type Side = "left" | "right" | "";

/**
 * Return the word and the side in a node's name: "mixamorig:LeftForeArm" is the left "forearm", "spine_01" is "spine".
 */
export function parseNodeName(name: string): { word: string; side: Side } {
  const local = name.split(/[:|]/).at(-1) ?? "";
  const parts = local
    .replace(/([a-z\d])([A-Z])/g, "$1 $2")
    .replace(/([A-Z])([A-Z][a-z])/g, "$1 $2")
    .toLowerCase()
    .split(/[^a-z\d]+/)
    .filter((part) => part && !NOISE_PATTERN.test(part) && !/^\d+$/.test(part));
  const side = parts.map((part) => SIDES[part]).find((found) => found) ?? "";
  const word = parts.filter((part) => !SIDES[part]).join("");
  return { word: word === "vl5" ? word : word.replace(/\d+$/, ""), side };
}

/**
 * Return the node index of each bone found, by VRM bone name. Of several candidates the one nearest to the root is
 * chosen.
 */
export function findBones(nodes: readonly NamedNode[]): Map<string, number> {
  const parsedNames = nodes.map(({ name }) => parseNodeName(name));
  let best = new Map<string, number>();
  for (const scheme of NAMING_SCHEMES) {
    const found = new Map<string, number>();
    const find = (words: BoneWords, side: Side) => {
      for (const [bone, candidateWords] of Object.entries(words)) {
        const ancestor = PARENT_BONE[bone];
        const ancestorNode =
          ancestor === undefined ? null : found.get(ancestor in CENTRE_WORDS ? ancestor : boneName(side, ancestor));
        if (ancestorNode === undefined) continue;
        const candidates = candidateWords.flatMap((word) =>
          parsedNames
            .flatMap((one, node) => (one.word === word && one.side === side ? [node] : []))
            .sort((a, b) => depth(nodes, a) - depth(nodes, b)),
        );
        const fit = candidates.find(
          (node) => ancestorNode === null || (node !== ancestorNode && isBelow(nodes, node, ancestorNode)),
        );
        if (fit !== undefined) found.set(boneName(side, bone), fit);
      }
    };
    find(CENTRE_WORDS, "");
    find(scheme, "left");
    find(scheme, "right");
    if (found.size > best.size) best = found;
  }
  return best;
}

/** Return the missing required bones in plain words: "left lower arm". */
export function missingBones(bones: ReadonlyMap<string, unknown>): string[] {
  return REQUIRED_BONES.filter((bone) => !bones.has(bone)).map((bone) =>
    bone.replace(/[A-Z]/g, (letter) => ` ${letter.toLowerCase()}`),
  );
}

function boneName(side: Side, bone: string): string {
  return side + bone;
}

function depth(nodes: readonly NamedNode[], node: number): number {
  let levels = 0;
  for (let at = node; at >= 0 && levels <= nodes.length; at = nodes[at].parent) levels++;
  return levels;
}

function isBelow(nodes: readonly NamedNode[], node: number, ancestor: number): boolean {
  let steps = 0;
  for (let at = node; at >= 0 && steps <= nodes.length; at = nodes[at].parent, steps++)
    if (at === ancestor) return true;
  return false;
}
