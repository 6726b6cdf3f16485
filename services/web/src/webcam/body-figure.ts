/**
 * Figure of a performer who is captured by a camera, 1.72 m tall: pictures tell nobody's size. Its bones lie along the
 * axes that the rotations are relative to, as far as the landmarks show them (`body-rotations.ts`).
 */
import type { PerformerFigure } from "../client/api";
import { type Figure, JOINTS } from "../motion/skeleton";

type Vector = readonly [x: number, y: number, z: number];

/** Length of an arm from shoulder to wrist, in metres. */
export const ARM_M = 0.57;
/** Height of the ankles above the floor, in metres. */
const ANKLE_M = 0.08;
/** Points of a foot that touch the floor, in the axes of its ankle, in metres: heel and tip of the toes. */
export const SOLE: readonly Vector[] = [
  [0, -ANKLE_M, -0.06],
  [0, -ANKLE_M, 0.18],
];

function bothSides(sign: 1 | -1): Record<string, Vector> {
  return {
    hip: [sign * 0.1, 0, 0],
    knee: [0, -0.42, 0],
    ankle: [0, -0.42, 0],
    midtarsal: [0, -0.065, 0.11],
    shoulder: [sign * 0.2, 0.35, 0],
    elbow: [0, -0.3, 0],
    wrist: [0, -0.27, 0],
  };
}

function withPrefix(prefix: string, vectors: Readonly<Record<string, Vector>>): Record<string, Vector> {
  return Object.fromEntries(Object.entries(vectors).map(([name, vector]) => [prefix + name, vector]));
}

/** The figure as the server takes it. */
export const BODY_FIGURE: PerformerFigure = {
  offsets: {
    humanoid_root: [0, 0.82, 0],
    sacroiliac: [0, 0.1, 0],
    vl5: [0, 0.25, 0],
    skullbase: [0, 0.5, 0],
    ...withPrefix("l_", bothSides(1)),
    ...withPrefix("r_", bothSides(-1)),
  },
  tips: {
    skullbase: [0, 0.15, 0],
    l_wrist: [0, -0.19, 0],
    r_wrist: [0, -0.19, 0],
    l_midtarsal: [0, 0, 0.07],
    r_midtarsal: [0, 0, 0.07],
  },
};

/** Return the figure for kinematics. */
export function bodyFigure(): Figure {
  const toTable = (vectors: PerformerFigure["tips"]) =>
    Float64Array.from(JOINTS.flatMap((name) => vectors[name] ?? [0, 0, 0]));
  return { offsets: toTable(BODY_FIGURE.offsets), tips: toTable(BODY_FIGURE.tips) };
}
