/**
 * The figure the puppet's parts are drawn on: the joint centres of H-Anim's LOA-1 example (ISO/IEC 19774-1), metres, y up,
 * facing z, its left at x. Every recipe in `parts/` uses these places; `fit.ts` then carries the parts over to a dancer.
 */
import { Vector3 } from "three";

const LEFT_JOINTS: Record<string, readonly [number, number, number]> = {
  hip: [0.0961, 0.9124, -0.0001],
  knee: [0.104, 0.4867, 0.0308],
  ankle: [0.1101, 0.0656, -0.0736],
  midtarsal: [0.1086, 0.0001, 0.0368],
  shoulder: [0.2029, 1.4376, -0.0387],
  elbow: [0.2014, 1.1357, -0.0682],
  wrist: [0.1984, 0.8663, -0.0583],
};

const CENTRE_JOINTS: Record<string, readonly [number, number, number]> = {
  humanoid_root: [0, 0.824, 0.0277],
  sacroiliac: [0, 0.9149, 0.0016],
  vl5: [0.0028, 1.0568, -0.0776],
  skullbase: [0.0044, 1.6209, 0.0236],
};

export type Side = "l" | "r";

/** The two sides, with the sign of x on each. */
export const SIDES: readonly { side: Side; sign: 1 | -1 }[] = [
  { side: "l", sign: 1 },
  { side: "r", sign: -1 },
];

/** Centre of a joint of the standard figure, a fresh vector. Throws on a name H-Anim does not know. */
export function jointPosition(name: string): Vector3 {
  const centre = CENTRE_JOINTS[name];
  if (centre) return new Vector3(...centre);
  const left = LEFT_JOINTS[name.slice(2)];
  if (!left) throw new Error(`no joint ${name} in the standard figure`);
  return new Vector3(name.startsWith("r_") ? -left[0] : left[0], left[1], left[2]);
}

/** Tips of the standard figure: crown and finger tips (toe tips are drawn from the midtarsal on). */
export const CROWN = new Vector3(0.005, 1.7504, 0.0055);
export const LEFT_FINGER_TIP = new Vector3(0.2056, 0.6743, -0.0482);
/** Height of the sole below a midtarsal joint. */
export const SOLE_HEIGHT_M = 0.0141;
/** Centre of the head the face is drawn about. */
export const HEAD_CENTRE = new Vector3(0.002, 1.634, 0.02);
