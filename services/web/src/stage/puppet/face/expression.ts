/** What the face of the puppet does of a performer's: eyes, brows and mouth, as those of a carved head. */
import { EXPRESSIONS, expressionIndex, type Face, type FacePose, faceExpressionNames } from "../../../motion/face";

/**
 * Movements of the face, in the order in which the shader reads them (`face-paint.ts`), four in a column. All are 0 at
 * rest. Left is the figure's left.
 */
export const MOVEMENTS = [
  // Upper lid: 1 is closed, -1 wide open. Lower lid: 1 is raised. Iris: to the figure's left and up.
  ...["leftLid", "leftLower", "leftIrisX", "leftIrisY"],
  ...["rightLid", "rightLower", "rightIrisX", "rightIrisY"],
  // Ends of the brows: 1 is raised, -1 lowered.
  ...["leftBrowIn", "leftBrowOut", "rightBrowIn", "rightBrowOut"],
  // Jaw: 1 is open. Mouth: 1 is wide, -1 narrow. Corners: 1 is up.
  ...["jaw", "mouth", "leftCorner", "rightCorner"],
] as const;

/** Movements that are never negative. */
const ONE_SIDED = new Set(["leftLower", "rightLower", "jaw"]);

/** Expressions, each with the movements at its weight of 1. A name without a side moves both sides. */
const EFFECTS: Readonly<Record<string, string>> = {
  eyeBlink: "Lid 1",
  eyeWide: "Lid -1",
  eyeSquint: "Lower 0.9, Lid 0.15",
  cheekSquint: "Lower 0.5",
  browDown: "BrowIn -1, BrowOut -0.5",
  browOuterUp: "BrowOut 1, BrowIn 0.1",
  noseSneer: "BrowIn -0.3",
  mouthSmile: "Corner 1, mouth 0.15",
  mouthFrown: "Corner -1",
  mouthDimple: "Corner 0.2, mouth 0.1",
  mouthStretch: "mouth 0.3, Corner -0.2",
  mouthLowerDown: "jaw 0.1",
  mouthUpperUp: "jaw 0.06",
  browInnerUp: "BrowIn 1, BrowOut 0.2",
  jawOpen: "jaw 1",
  mouthClose: "jaw -0.9",
  mouthFunnel: "mouth -0.7, jaw 0.25",
  mouthPucker: "mouth -1",
  blink: "Lid 1",
  happy: "Corner 1, mouth 0.3, Lower 0.8, Lid 0.12, BrowIn 0.25, BrowOut 0.35",
  angry: "BrowIn -1, BrowOut 0.6, Lid 0.1, Lower 0.35, Corner -0.6, mouth -0.1",
  sad: "BrowIn 1, BrowOut -0.7, Lid 0.28, Corner -0.8, mouth -0.15",
  relaxed: "Lid 0.42, Corner 0.5, BrowIn 0.15, BrowOut 0.1",
  surprised: "Lid -1, BrowIn 0.9, BrowOut 1, jaw 0.45, mouth -0.35",
  aa: "jaw 1",
  ih: "jaw 0.3, mouth 0.5",
  ou: "jaw 0.4, mouth -1",
  ee: "jaw 0.22, mouth 0.8",
  oh: "jaw 0.75, mouth -0.65",
  lookLeft: "IrisX 1",
  lookRight: "IrisX -1",
  lookUp: "IrisY 1",
  lookDown: "IrisY -1",
  eyeLookUp: "IrisY 1",
  eyeLookDown: "IrisY -1",
};
/** Expressions of one eye or side whose movement depends on the side. */
const SIDED_EFFECTS: Readonly<Record<string, string>> = {
  eyeLookOutLeft: "leftIrisX 1",
  eyeLookInLeft: "leftIrisX -1",
  eyeLookInRight: "rightIrisX 1",
  eyeLookOutRight: "rightIrisX -1",
  // The gaze is in radians: at 0.6 to a side, and 0.5 up or down, the iris is at its end.
  gazeYaw: "IrisX 1.67",
  gazePitch: "IrisY 2",
};
/** Share of the upper lids' way that they follow the iris down. */
const LID_FOLLOWS = 0.35;
/** Expressions that say how far the eyes are closed. */
const BLINK_NAMES = /^(eyeBlink|blink)/;

type Effect = readonly [expression: number, movement: number, factor: number];

/** Return the movements that each expression contributes to. */
export function parseEffects(): Effect[] {
  const side = (name: string) => /(Left|Right)$/.exec(name)?.[0].toLowerCase();
  return EXPRESSIONS.flatMap((name) => {
    const effects = SIDED_EFFECTS[name] ?? EFFECTS[name] ?? EFFECTS[name.replace(/(Left|Right)$/, "")] ?? "";
    const only = name in SIDED_EFFECTS || name in EFFECTS ? undefined : side(name);
    return effects.split(", ").flatMap((effect): Effect[] => {
      const [movement, factor] = effect.split(" ");
      return MOVEMENTS.flatMap((one, at): Effect[] => {
        const isBoth = /^[A-Z]/.test(movement) && one.endsWith(movement) && (!only || one.startsWith(only));
        if (!isBoth && one !== movement) return [];
        // A movement of both sides gets half of it from each.
        const share = only && one === movement ? 0.5 : 1;
        return [[expressionIndex(name), at, Number(factor) * share]];
      });
    });
  });
}

const index = (name: (typeof MOVEMENTS)[number]) => MOVEMENTS.indexOf(name);
const LIDS = [index("leftLid"), index("rightLid")];

export class FaceExpression {
  readonly #effects = parseEffects();
  readonly #movements = new Float64Array(MOVEMENTS.length);
  #face: Face | null = null;
  #hasLids = false;

  /** Return the movements of a pose, each within -1..1. `blink` closes the eyes if the pose has no lids. */
  update(pose: FacePose | null, blink: number): Float64Array {
    const movements = this.#movements.fill(0);
    if (pose) {
      if (pose.face !== this.#face) {
        this.#face = pose.face;
        this.#hasLids = faceExpressionNames(pose.face).some((name) => BLINK_NAMES.test(name));
      }
      for (const [expression, movement, factor] of this.#effects)
        movements[movement] += factor * pose.weights[expression];
      for (const lid of LIDS) movements[lid] += LID_FOLLOWS * Math.min(Math.max(-movements[lid + 3], 0), 1);
    }
    if (!pose || !this.#hasLids) for (const lid of LIDS) movements[lid] += (1 - movements[lid]) * blink;
    MOVEMENTS.forEach((name, at) => {
      const value = Math.min(Math.max(movements[at], ONE_SIDED.has(name) ? 0 : -1), 1);
      movements[at] = Number.isFinite(value) ? value : 0;
    });
    return movements;
  }
}
