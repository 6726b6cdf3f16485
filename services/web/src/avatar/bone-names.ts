/** Which node of a plain glTF file is which bone of a humanoid, by the names that the usual tools give them. Pure. */

/** A node's name as the file has it, and the index of its parent; -1 for a root. */
export interface NamedNode {
  name: string;
  parent: number;
}

/** The bones an avatar must have: what the stream moves, but for the toes. VRM asks for the same. */
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

/** Words for a bone, the likeliest first: without side, case, numbers and what stands between. */
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

/** What the limbs are called: the same word is the upper arm in one school and the collar bone in another. */
const NAMING_SCHEMES: readonly BoneWords[] = [
  // VRoid, Unreal, Unity, 3ds Max, Blender
  COMMON_WORDS,
  // Mixamo
  { ...COMMON_WORDS, UpperArm: ["arm"], LowerLeg: ["leg"] },
  // H-Anim, and whatever names joints, not bones
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
  // VRChat's tools
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

/** What each bone hangs from, at any depth. */
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

/** Said of the tool or of the skeleton, not of the bone. */
const NOISE_PATTERN =
  /^(mixamorig|bip|valvebiped|hanim|def|org|armature|character|skeleton|rig|cc|base|j|jnt|joint|bone|c|center|b)\d*$/;
const SIDES: Readonly<Record<string, Side>> = { l: "left", left: "left", r: "right", right: "right" };

type Side = "left" | "right" | "";

/** A bone's word and side, of a node's name: "mixamorig:LeftForeArm" is the left "forearm", "spine_01" is "spine". */
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

/** Index of the node of each bone that is found, by VRM's names of bones; of several that would do the one nearest to the root. */
export function findBones(nodes: readonly NamedNode[]): Map<string, number> {
  const known = nodes.map(({ name }) => parseNodeName(name));
  let best = new Map<string, number>();
  for (const school of NAMING_SCHEMES) {
    const found = new Map<string, number>();
    const find = (words: BoneWords, side: Side) => {
      for (const [bone, said] of Object.entries(words)) {
        const above = PARENT_BONE[bone];
        const from = above === undefined ? null : found.get(above in CENTRE_WORDS ? above : boneName(side, above));
        if (from === undefined) continue;
        const candidates = said.flatMap((word) =>
          known
            .flatMap((one, node) => (one.word === word && one.side === side ? [node] : []))
            .sort((a, b) => depth(nodes, a) - depth(nodes, b)),
        );
        const fit = candidates.find((node) => from === null || (node !== from && isBelow(nodes, node, from)));
        if (fit !== undefined) found.set(boneName(side, bone), fit);
      }
    };
    find(CENTRE_WORDS, "");
    find(school, "left");
    find(school, "right");
    if (found.size > best.size) best = found;
  }
  return best;
}

/** Which of the required bones are not there, in plain words: "left lower arm". */
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

function isBelow(nodes: readonly NamedNode[], node: number, above: number): boolean {
  let steps = 0;
  for (let at = node; at >= 0 && steps <= nodes.length; at = nodes[at].parent, steps++) if (at === above) return true;
  return false;
}
