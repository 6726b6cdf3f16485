/**
 * Body extension: spine, neck and clavicles of a performer, beside the figure's channels (`proto/codec.md`, 2.17). It
 * computes what `motion/extension.py` does in Python, where the model is described.
 */

import type { FacePose } from "./face";
import type { FootContacts } from "./foot-contact";
import type { HandsPose } from "./hands";
import { conjugate, fromRotationVector, multiply, type Numbers, rotate, toRotationVector } from "./rotation";
import { type Figure, JOINT_COUNT, JOINTS, type Pose, type WorldTransforms } from "./skeleton";
import { addScaled, dot, length, normalise, rotationBetween, setVector, unit } from "./vector";

/** Names of the spine's joints, by their number; with any, they take the place of the figure's own vl5. */
export const SPINE_NAMES: readonly (readonly string[])[] = [
  [],
  ["vl5"],
  ["vl5", "vt10"],
  ["vl5", "vl1", "vt10"],
  ["vl5", "vl1", "vt10", "vt6"],
];
export const NECK_NAME = "vc4";
export const CLAVICLE_NAMES: readonly string[] = ["l_sternoclavicular", "r_sternoclavicular"];

/** What a joint of an extension is: it decides the joint's parent and driver. */
export type JointKind = "spine" | "neck" | "left clavicle" | "right clavicle";

const VL5 = JOINTS.indexOf("vl5");
/** Joints that an extension carries: skullbase and shoulders, in the order of `ends`. */
export const END_JOINTS: readonly number[] = ["skullbase", "l_shoulder", "r_shoulder"].map((name) =>
  JOINTS.indexOf(name),
);
const END_OF: Readonly<Record<JointKind, number>> = { spine: -1, neck: 0, "left clavicle": 1, "right clavicle": 2 };

/**
 * Joints of an extension, E in all: those of the spine upwards, then the neck, then both clavicles. The chest is the
 * last joint of the spine, or the root; it is the parent of neck and clavicles.
 */
export interface BodyExtension {
  readonly kinds: readonly JointKind[];
  /** H-Anim name of each joint. */
  readonly names: readonly string[];
  /** Positions [E][3] of the joints from their parents, metres at rest. */
  readonly offsets: Float64Array;
  /** Positions [3][3] of skullbase and shoulders from neck and clavicles, or from the chest. */
  readonly ends: Float64Array;
  /** Matrices [E][3][3] that apply to the drivers, and rotation vectors [E][3] that are added, radians. */
  readonly drive: Float64Array;
  readonly rest: Float64Array;
}

/** Return the kinds of an extension's joints. */
export function extensionKinds(spineCount: number, hasNeck: boolean, hasClavicles: boolean): JointKind[] {
  return [
    ...new Array<JointKind>(spineCount).fill("spine"),
    ...(hasNeck ? (["neck"] as const) : []),
    ...(hasClavicles ? (["left clavicle", "right clavicle"] as const) : []),
  ];
}

/** Return the names of an extension's joints. */
export function extensionNames(kinds: readonly JointKind[]): string[] {
  const spine = SPINE_NAMES[kinds.filter((kind) => kind === "spine").length];
  return kinds.map((kind, index) =>
    kind === "spine" ? spine[index] : kind === "neck" ? NECK_NAME : CLAVICLE_NAMES[END_OF[kind] - 1],
  );
}

/** World positions (metres) and orientations of a figure's joints and of those of its extension. */
export interface ExtendedPose extends WorldTransforms {
  readonly extension: BodyExtension;
  /** Positions [E][3] and orientations [E][4] of the extension's joints. */
  readonly extraPositions: Float64Array;
  readonly extraOrientations: Float64Array;
}

/**
 * Pose of a performer on the stage, with what its extensions add: further joints of the body, fingers, a face, and the
 * contacts of its feet, null if they are not known.
 */
export interface StagedPose extends Pose {
  extended?: ExtendedPose | null;
  hands?: HandsPose | null;
  face?: FacePose | null;
  contacts?: FootContacts | null;
}

/** Create storage for `extendPose`. */
export function createExtendedPose(extension: BodyExtension): ExtendedPose {
  const count = extension.kinds.length;
  return {
    extension,
    positions: new Float64Array(JOINT_COUNT * 3),
    orientations: new Float64Array(JOINT_COUNT * 4),
    extraPositions: new Float64Array(count * 3),
    extraOrientations: new Float64Array(count * 4),
  };
}

const driver = new Float64Array(3);
const turn = new Float64Array(4);
const inverse = new Float64Array(4);
const carried = new Float64Array(3);

/**
 * Write the extended pose of a figure into `out` and return it.
 *
 * @param world world transforms of the figure's own pose
 * @param values values [E][3] of the extension, radians
 */
export function extendPose(figure: Figure, world: WorldTransforms, values: Numbers, out: ExtendedPose): ExtendedPose {
  const { extension, extraPositions: places, extraOrientations: turns } = out;
  const { kinds, offsets, ends, drive, rest } = extension;
  out.positions.set(world.positions);
  out.orientations.set(world.orientations);
  const spineCount = kinds.lastIndexOf("spine") + 1;
  const chest = spineCount - 1;
  for (let joint = 0; joint < kinds.length; joint++) {
    const kind = kinds[joint];
    const parent = kind === "spine" ? joint - 1 : chest;
    const [parentPlaces, parentTurns, at] =
      parent < 0 ? [world.positions, world.orientations, 0] : [places, turns, parent];
    rotate(places, joint * 3, parentTurns, at * 4, offsets, joint * 3);
    for (let i = 0; i < 3; i++) places[joint * 3 + i] += parentPlaces[at * 3 + i];
    // rotations of the spine are relative to the root
    const [frames, frame] = kind === "spine" || chest < 0 ? [world.orientations, 0] : [turns, chest];
    findDriver(kind, world, frames, frame);
    for (let i = 0; i < 3; i++) {
      const row = joint * 9 + i * 3;
      carried[i] =
        drive[row] * driver[0] +
        drive[row + 1] * driver[1] +
        drive[row + 2] * driver[2] +
        rest[joint * 3 + i] +
        values[joint * 3 + i];
    }
    fromRotationVector(turn, 0, carried[0], carried[1], carried[2]);
    multiply(turns, joint * 4, frames, frame * 4, turn, 0);
  }
  END_JOINTS.forEach((joint, end) => {
    const carrier = kinds.findIndex((kind) => END_OF[kind] === end);
    const at = carrier < 0 ? chest : carrier;
    const [carrierPlaces, carrierTurns] = at < 0 ? [world.positions, world.orientations] : [places, turns];
    rotate(carried, 0, carrierTurns, Math.max(at, 0) * 4, ends, end * 3);
    for (let i = 0; i < 3; i++) out.positions[joint * 3 + i] = carrierPlaces[Math.max(at, 0) * 3 + i] + carried[i];
  });
  for (const shoulder of END_JOINTS.slice(1)) {
    extendBone(figure, world.positions, shoulder, out);
    extendBone(figure, world.positions, shoulder + 1, out);
  }
  return out;
}

/** Write what the rotation of a joint is a linear function of: the neck's is relative to the given frame. */
function findDriver(
  kind: JointKind,
  { positions, orientations }: WorldTransforms,
  frames: Numbers,
  frame: number,
): void {
  if (kind === "spine" || kind === "neck") {
    conjugate(inverse, 0, frames, frame * 4);
    multiply(turn, 0, inverse, 0, orientations, (kind === "spine" ? VL5 : END_JOINTS[0]) * 4);
    toRotationVector(driver, 0, turn, 0);
    return;
  }
  const shoulder = END_JOINTS[END_OF[kind]] * 3;
  addScaled(driver, 0, positions, shoulder + 3, positions, shoulder, -1);
  if (!unit(driver, 0, driver, 0)) setVector(driver, 0, 0, 0, 0);
  conjugate(inverse, 0, orientations, VL5 * 4);
  rotate(driver, 0, inverse, 0, driver, 0);
}

const before = new Float64Array(3);
const after = new Float64Array(3);

/** Move the end of an arm's bone to the line of the figure's own bone, and turn the bone towards it. */
function extendBone({ offsets }: Figure, positions: Numbers, joint: number, out: ExtendedPose): void {
  const from = joint * 3,
    to = from + 3;
  addScaled(before, 0, positions, to, positions, from, -1);
  if (!unit(before, 0, before, 0)) return;
  meetBone(positions, from, before, out.positions, length(offsets, to));
  addScaled(after, 0, out.positions, to, out.positions, from, -1);
  if (!unit(after, 0, after, 0)) return;
  rotationBetween(turn, 0, before, 0, after, 0);
  multiply(out.orientations, joint * 4, turn, 0, out.orientations, joint * 4);
  normalise(out.orientations, joint * 4);
}

/**
 * Write the end of a bone of length `size` from the joint at `from` of `out` that lies on a line: through the joint at
 * `from` of `positions`, along the unit vector `along`. A line that is too far away gives the direction of its nearest
 * point.
 */
export function meetBone(positions: Numbers, from: number, along: Numbers, out: Numbers, size: number): void {
  const to = from + 3;
  addScaled(after, 0, out, from, positions, from, -1);
  const nearest = dot(after, 0, along, 0);
  const ahead = nearest + Math.sqrt(Math.max(nearest * nearest - dot(after, 0, after, 0) + size * size, 0));
  addScaled(out, to, positions, from, along, 0, ahead);
  addScaled(after, 0, out, to, out, from, -1);
  if (!unit(after, 0, after, 0)) setVector(after, 0, along[0], along[1], along[2]);
  addScaled(out, to, out, from, after, 0, size);
}
