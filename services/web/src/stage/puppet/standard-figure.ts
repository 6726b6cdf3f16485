/**
 * Figure on which the puppet's parts are modelled: the joint centres of H-Anim's LOA-1 example (ISO/IEC 19774-1), in
 * metres, y up, facing z, its left at +x. The modules in `parts/` use these positions; `figure-fit.ts` maps the parts
 * to a performer.
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

/** The two sides, with the sign of x. */
export const SIDES: readonly { side: Side; sign: 1 | -1 }[] = [
  { side: "l", sign: 1 },
  { side: "r", sign: -1 },
];

/** Return the centre of a joint as a new vector. Throw if H-Anim has no joint of that name. */
export function jointPosition(name: string): Vector3 {
  const centre = CENTRE_JOINTS[name];
  if (centre) return new Vector3(...centre);
  const left = LEFT_JOINTS[name.slice(2)];
  if (!left) throw new Error(`The standard figure has no joint "${name}".`);
  return new Vector3(name.startsWith("r_") ? -left[0] : left[0], left[1], left[2]);
}

/** Tips of the standard figure: crown and finger tips (toes are modelled from the midtarsal joint). */
export const CROWN = new Vector3(0.005, 1.7504, 0.0055);
export const LEFT_FINGER_TIP = new Vector3(0.2056, 0.6743, -0.0482);
/** Height of the midtarsal joint above the sole. */
export const SOLE_HEIGHT_M = 0.0141;
/** Centre of the head. */
export const HEAD_CENTRE = new Vector3(0.002, 1.634, 0.02);
