import { expect, test } from "vitest";
import { findFingers } from "../../../src/avatar/hands/finger-names";
import { loadVectors } from "../../golden-vectors";

interface NamedHand {
  readonly why: string;
  readonly names: readonly string[];
  readonly parents: readonly number[];
  readonly fingers: readonly (readonly number[])[];
}

test.each(loadVectors<{ hands: readonly NamedHand[] }>("hand_face_names").hands)(
  "fingers are those of the server: $why",
  ({ names, parents, fingers }) => {
    expect(findFingers(names, parents, 0)).toEqual(fingers);
  },
);

const FINGERS = ["Thumb", "Index", "Middle", "Ring", "Pinky"];
const numbers = [1, 2, 3];

/** Names of the joints of each finger from the wrist outwards, and of joints between wrist and finger. */
interface Convention {
  readonly fingers: readonly (readonly string[])[];
  readonly palm?: readonly (string | null)[];
  readonly ends?: readonly string[];
}

const CONVENTIONS: Readonly<Record<string, Convention>> = {
  Mixamo: {
    fingers: FINGERS.map((finger) => numbers.map((number) => `mixamorig:LeftHand${finger}${number}`)),
    ends: FINGERS.map((finger) => `mixamorig:LeftHand${finger}4`),
  },
  "Perception Neuron": {
    fingers: FINGERS.map((finger) => numbers.map((number) => `LeftHand${finger}${number}`)),
    palm: [null, ...FINGERS.slice(1).map((finger) => `LeftInHand${finger}`)],
  },
  Unreal: {
    fingers: FINGERS.map((finger) => numbers.map((number) => `${finger.toLowerCase()}_0${number}_l`)),
    palm: [null, ...FINGERS.slice(1).map((finger) => `${finger.toLowerCase()}_metacarpal_l`)],
  },
  Biped: {
    fingers: FINGERS.map((_, finger) => ["", "1", "2"].map((joint) => `Bip01 L Finger${finger}${joint}`)),
    ends: FINGERS.map((_, finger) => `Bip01 L Finger${finger}Nub`),
  },
  Rigify: {
    fingers: FINGERS.map((finger, at) =>
      numbers.map((number) => `DEF-${at === 0 ? "" : "f_"}${finger.toLowerCase()}.0${number}.L`),
    ),
    palm: [null, ...numbers.map((number) => `DEF-palm.0${number}.L`), "DEF-palm.04.L"],
  },
  "Character Creator": {
    fingers: FINGERS.map((finger) => numbers.map((number) => `CC_Base_L_${finger.replace("Middle", "Mid")}${number}`)),
  },
  Daz: {
    fingers: FINGERS.map((finger) => numbers.map((number) => `l${finger.replace("Middle", "Mid")}${number}`)),
    palm: [null, "lCarpal1", "lCarpal2", "lCarpal3", "lCarpal4"],
  },
  VRoid: {
    fingers: FINGERS.map((finger) => numbers.map((number) => `J_Bip_L_${finger.replace("Pinky", "Little")}${number}`)),
  },
  MakeHuman: {
    fingers: FINGERS.map((_, finger) => numbers.map((number) => `finger${finger + 1}-${number}.L`)),
    palm: [null, "metacarpal1.L", "metacarpal2.L", "metacarpal3.L", "metacarpal4.L"],
  },
  "SMPL-X": { fingers: FINGERS.map((finger) => numbers.map((number) => `left_${finger.toLowerCase()}${number}`)) },
  "H-Anim 1": {
    fingers: FINGERS.map((finger) => numbers.map((number) => `l_${finger.toLowerCase()}${number}`)),
    palm: [null, ...FINGERS.slice(1).map((finger) => `l_${finger.toLowerCase()}0`)],
  },
  "H-Anim 2": {
    fingers: FINGERS.map((_, finger) =>
      finger === 0
        ? ["l_carpometacarpal_1", "l_metacarpophalangeal_1", "l_carpal_interphalangeal_1"]
        : ["metacarpophalangeal", "carpal_proximal_interphalangeal", "carpal_distal_interphalangeal"].map(
            (joint) => `l_${joint}_${finger + 1}`,
          ),
    ),
    palm: [null, "l_carpometacarpal_2", "l_carpometacarpal_3", "l_carpometacarpal_4", "l_carpometacarpal_5"],
  },
  Xsens: {
    fingers: ["First", "Second", "Third", "Fourth", "Fifth"].map((finger, at) =>
      (at === 0 ? ["MC", "PP", "DP"] : ["PP", "MP", "DP"]).map((joint) => `Left${finger}${joint}`),
    ),
    palm: [null, "LeftSecondMC", "LeftThirdMC", "LeftFourthMC", "LeftFifthMC"],
  },
  MikuMikuDance: {
    fingers: [
      ["左親指０", "左親指１", "左親指２"],
      ...["人", "中", "薬", "小"].map((finger) => ["１", "２", "３"].map((number) => `左${finger}指${number}`)),
    ],
  },
  VRChat: {
    fingers: [
      ["Thumb0_L", "Thumb1_L", "Thumb2_L"],
      ...["Index", "Middle", "Ring", "Little"].map((finger) => numbers.map((number) => `${finger}Finger${number}_L`)),
    ],
  },
};

/** Return the joints of a hand with the names of a convention. */
function treeOf({ fingers, palm = [], ends = [] }: Convention): { names: string[]; parents: number[] } {
  const names = ["hand"];
  const parents = [-1];
  fingers.forEach((chain, finger) => {
    let above = 0;
    for (const name of [palm[finger] ?? null, ...chain, ends[finger] ?? null]) {
      if (name === null) continue;
      parents.push(above);
      above = names.push(name) - 1;
    }
  });
  return { names, parents };
}

test.each(Object.entries(CONVENTIONS))("fingers named as %s are found", (_, convention) => {
  const { names, parents } = treeOf(convention);
  const found = findFingers(names, parents, 0).map((chain) => chain.map((joint) => names[joint]));
  expect(found).toEqual(convention.fingers);
});

test("missing and unnamed fingers have no joints, and a mitten is the index finger", () => {
  const { names, parents } = treeOf({ fingers: [["thumb_l"], ["sleeve"], ["Fingers_L"]] });
  expect(findFingers(names, parents, 0)).toEqual([[1], [3], [], [], []]);
});

test("joints beside the hand are not its fingers", () => {
  expect(findFingers(["arm", "hand", "index1"], [-1, 0, 0], 1)).toEqual([[], [], [], [], []]);
});
