/** Bones of the figures in test files: places in the T-pose, angles of other rest poses, and names. */
import { Vector3 } from "three";
import { VRM_NAMES } from "../../src/motion/hands";

/** Rest pose and proportions of a figure. */
export interface FigureShape {
  /** Angle of the arms below level and of the legs from vertical, in degrees. */
  arms?: number;
  legs?: number;
  /** Length of legs and forearms relative to an adult's. */
  legLength?: number;
  forearm?: number;
  /** Height of the head above its joint, in metres. */
  headHeight?: number;
  without?: readonly string[];
  /** Add a tail with spring bones (VRM 1). */
  tail?: boolean;
  /** Joints of each finger; without it, the hand has one bone, the first of the middle finger. */
  fingers?: number;
  /** Angle between one bone of a finger at rest and the next, in degrees. */
  curl?: number;
}

export interface Bone {
  name: string;
  parent: string | null;
  /** From the parent in the T-pose, in metres. */
  offset: Vector3;
  /** End of its box, relative to it. */
  end: Vector3;
}

export const at = (x: number, y: number, z: number) => new Vector3(x, y, z);

/** Return the bones of an adult of 1.65 m in the T-pose, facing z; parents first. */
export function bonesOf({
  legLength = 1,
  forearm = 1,
  headHeight = 0.2,
  without = [],
  tail = false,
  fingers = 0,
}: FigureShape): Bone[] {
  const bones: Bone[] = [
    { name: "hips", parent: null, offset: at(0, 0.06 + 0.86 * legLength, 0), end: at(0, 0.1, 0) },
    { name: "spine", parent: "hips", offset: at(0, 0.09, -0.01), end: at(0, 0.11, 0) },
    { name: "chest", parent: "spine", offset: at(0, 0.12, 0), end: at(0, 0.2, 0) },
    { name: "neck", parent: "chest", offset: at(0, 0.24, -0.01), end: at(0, 0.08, 0) },
    { name: "head", parent: "neck", offset: at(0, 0.09, 0.01), end: at(0, headHeight, 0) },
  ];
  for (const [side, x] of [
    ["left", 1],
    ["right", -1],
  ] as const) {
    bones.push(
      { name: `${side}Shoulder`, parent: "chest", offset: at(0.04 * x, 0.18, 0), end: at(0.1 * x, 0, 0) },
      { name: `${side}UpperArm`, parent: `${side}Shoulder`, offset: at(0.12 * x, 0, 0), end: at(0.26 * x, 0, 0) },
      {
        name: `${side}LowerArm`,
        parent: `${side}UpperArm`,
        offset: at(0.26 * x, 0, 0),
        end: at(0.24 * forearm * x, 0, 0),
      },
      { name: `${side}Hand`, parent: `${side}LowerArm`, offset: at(0.24 * forearm * x, 0, 0), end: at(0.17 * x, 0, 0) },
      { name: `${side}MiddleProximal`, parent: `${side}Hand`, offset: at(0.08 * x, 0, 0), end: at(0.09 * x, 0, 0) },
      { name: `${side}UpperLeg`, parent: "hips", offset: at(0.09 * x, -0.06, 0), end: at(0, -0.41 * legLength, 0) },
      {
        name: `${side}LowerLeg`,
        parent: `${side}UpperLeg`,
        offset: at(0, -0.41 * legLength, 0),
        end: at(0, -0.39 * legLength, 0),
      },
      {
        name: `${side}Foot`,
        parent: `${side}LowerLeg`,
        offset: at(0, -0.39 * legLength, -0.02),
        end: at(0, -0.06 * legLength, 0.14),
      },
      { name: `${side}Toes`, parent: `${side}Foot`, offset: at(0, -0.05 * legLength, 0.13), end: at(0, 0, 0.07) },
    );
  }
  for (const [chain, names] of fingers > 0 ? VRM_NAMES.entries() : []) {
    const x = chain < 5 ? 1 : -1;
    const finger = chain % 5;
    names.slice(0, fingers).forEach((name, place) => {
      const length = finger === 0 ? 0.03 : 0.035;
      const end = finger === 0 ? at(Math.SQRT1_2 * length * x, 0, Math.SQRT1_2 * length) : at(length * x, 0, 0);
      const base = finger === 0 ? at(0.02 * x, 0, 0.02) : at(0.08 * x, 0, 0.04 - 0.02 * finger);
      const parent = place === 0 ? (x > 0 ? "leftHand" : "rightHand") : names[place - 1];
      const existing = bones.find((bone) => bone.name === name);
      const bone = { name, parent, offset: place === 0 ? base : end, end };
      if (existing) Object.assign(existing, bone);
      else bones.push(bone);
    });
  }
  if (tail)
    bones.push(
      { name: "tail", parent: "hips", offset: at(0, 0, -0.08), end: at(0, 0, -0.3) },
      { name: "tailEnd", parent: "tail", offset: at(0, 0, -0.3), end: at(0, 0, -0.02) },
    );
  return bones
    .filter(({ name }) => !without.includes(name))
    .map((bone) => ({ ...bone, parent: bone.parent && without.includes(bone.parent) ? "hips" : bone.parent }));
}

/** Return the rotation of a bone from the T-pose about z, in radians. */
export function bend(name: string, { arms = 0, legs = 0, curl = 0, fingers = 0 }: FigureShape): number {
  const sign = name.startsWith("left") ? 1 : -1;
  const chain = fingers > 0 ? VRM_NAMES.findIndex((names) => names.includes(name)) : -1;
  if (chain >= 0) {
    const place = VRM_NAMES[chain].indexOf(name);
    return (-sign * (arms + (chain % 5 === 0 ? 0 : curl * (place + 1))) * Math.PI) / 180;
  }
  if (/UpperArm|LowerArm|Hand|MiddleProximal/.test(name)) return (-sign * arms * Math.PI) / 180;
  return /UpperLeg|LowerLeg/.test(name) ? (sign * legs * Math.PI) / 180 : 0;
}

/** Return the name of a Mixamo bone. */
export function mixamoName(bone: string): string {
  const side = bone.startsWith("left") ? "Left" : bone.startsWith("right") ? "Right" : "";
  const words: Record<string, string> = {
    hips: "Hips",
    spine: "Spine",
    chest: "Spine1",
    neck: "Neck",
    head: "Head",
    Shoulder: "Shoulder",
    UpperArm: "Arm",
    LowerArm: "ForeArm",
    Hand: "Hand",
    MiddleProximal: "HandMiddle1",
    UpperLeg: "UpLeg",
    LowerLeg: "Leg",
    Foot: "Foot",
    Toes: "ToeBase",
  };
  const finger = VRM_NAMES.flat().includes(bone) && bone !== `${bone.slice(0, side.length)}MiddleProximal`;
  if (finger) {
    const chain = VRM_NAMES.findIndex((names) => names.includes(bone));
    const named = ["Thumb", "Index", "Middle", "Ring", "Pinky"][chain % 5];
    return `mixamorig:${side}Hand${named}${VRM_NAMES[chain].indexOf(bone) + 1}`;
  }
  const word = words[bone.slice(side.length)];
  if (!word) throw new Error(`Mixamo has no ${bone}`);
  return `mixamorig:${side}${word}`;
}
