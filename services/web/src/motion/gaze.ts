/** Direction of a performer's eyes, from the expressions of a face that give it. */

import { expressionIndex, type FacePose, faceExpressionNames } from "./face";

/** Rotation of an eye at the full weight of an expression that turns it, sideways and up or down, in radians. */
export const EYE_YAW_RAD = (35 * Math.PI) / 180;
export const EYE_PITCH_RAD = (25 * Math.PI) / 180;

/** Direction of both eyes relative to the head, in radians: to the performer's left, and up. */
export interface Gaze {
  yaw: number;
  pitch: number;
}

/** Ways in which a face gives its gaze, the most exact one first. */
export type GazeSource = "gaze" | "preset" | "eyes";

const term = (name: string, factor: number) => [expressionIndex(name), factor] as const;
/** Expressions that give yaw and pitch, each with its factor in radians. */
const TERMS: Readonly<Record<GazeSource, Readonly<Record<keyof Gaze, readonly (readonly [number, number])[]>>>> = {
  gaze: { yaw: [term("gazeYaw", 1)], pitch: [term("gazePitch", 1)] },
  preset: {
    yaw: [term("lookLeft", EYE_YAW_RAD), term("lookRight", -EYE_YAW_RAD)],
    pitch: [term("lookUp", EYE_PITCH_RAD), term("lookDown", -EYE_PITCH_RAD)],
  },
  eyes: {
    yaw: [
      term("eyeLookOutLeft", EYE_YAW_RAD / 2),
      term("eyeLookInRight", EYE_YAW_RAD / 2),
      term("eyeLookInLeft", -EYE_YAW_RAD / 2),
      term("eyeLookOutRight", -EYE_YAW_RAD / 2),
    ],
    pitch: [
      term("eyeLookUpLeft", EYE_PITCH_RAD / 2),
      term("eyeLookUpRight", EYE_PITCH_RAD / 2),
      term("eyeLookDownLeft", -EYE_PITCH_RAD / 2),
      term("eyeLookDownRight", -EYE_PITCH_RAD / 2),
    ],
  },
};

/** Return the best source of the gaze among the expressions that a face knows, or null if there is none. */
export function findGazeSource(face: FacePose["face"]): GazeSource | null {
  const known = new Set(faceExpressionNames(face).map(expressionIndex));
  const sources = Object.keys(TERMS) as GazeSource[];
  return (
    sources.find((source) => Object.values(TERMS[source]).some((terms) => terms.some(([index]) => known.has(index)))) ??
    null
  );
}

/** Write the gaze of a face's weights into `out` and return it. */
export function gazeFrom(source: GazeSource, weights: Float64Array, out: Gaze): Gaze {
  out.yaw = out.pitch = 0;
  for (const [index, factor] of TERMS[source].yaw) out.yaw += factor * weights[index];
  for (const [index, factor] of TERMS[source].pitch) out.pitch += factor * weights[index];
  return out;
}
