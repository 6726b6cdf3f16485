/**
 * Face of a performer: weights of expressions, and the axes that they are coded in (`proto/codec.md`, 2.19). It
 * computes what `motion/face.py` does in Python, where the model is described.
 */

const SINGLE = [
  "jawForward",
  "jawOpen",
  "mouthClose",
  "mouthFunnel",
  "mouthPucker",
  "mouthRollLower",
  "mouthRollUpper",
  "mouthShrugLower",
  "mouthShrugUpper",
  "browInnerUp",
  "cheekPuff",
  "tongueOut",
];
const PAIRED = [
  "eyeBlink",
  "eyeSquint",
  "eyeWide",
  "mouthSmile",
  "mouthFrown",
  "mouthDimple",
  "mouthStretch",
  "mouthPress",
  "mouthLowerDown",
  "mouthUpperUp",
  "browDown",
  "browOuterUp",
  "cheekSquint",
  "noseSneer",
];
/** Presets of VRM 1.0 of which each is one axis. */
const VRM_SINGLE = "happy angry sad relaxed surprised neutral aa ih ou ee oh blink".split(" ");
/** Direction of both eyes relative to the head, in radians: to the performer's left, and up. */
export const GAZE: readonly string[] = ["gazeYaw", "gazePitch"];
const MAX_GAZE_RAD = Math.PI / 2;

/** One expression, or two that exclude each other: the weight of the first minus that of the second. */
type Term = readonly string[];

/** Terms that are coded together: one has one axis; two have two, their sum and their difference over sqrt(2). */
const TERMS: readonly (readonly Term[])[] = [
  ...SINGLE.map((name) => [[name]]),
  ...PAIRED.map((name) => [[`${name}Left`], [`${name}Right`]]),
  [["jawLeft", "jawRight"]],
  [["mouthLeft", "mouthRight"]],
  [
    ["eyeLookOutLeft", "eyeLookInLeft"],
    ["eyeLookInRight", "eyeLookOutRight"],
  ],
  [
    ["eyeLookUpLeft", "eyeLookDownLeft"],
    ["eyeLookUpRight", "eyeLookDownRight"],
  ],
  ...VRM_SINGLE.map((name) => [[name]]),
  [["blinkLeft"], ["blinkRight"]],
  [["lookLeft", "lookRight"]],
  [["lookUp", "lookDown"]],
  ...GAZE.map((name) => [[name]]),
];
/** Names of all expressions. */
export const EXPRESSIONS: readonly string[] = TERMS.flat(2);
export const AXIS_COUNT = TERMS.flat().length;

const INDEX = new Map(EXPRESSIONS.map((name, index) => [name, index]));

/** Return the place of an expression in the weights of a face, -1 if it is unknown. */
export function expressionIndex(name: string): number {
  return INDEX.get(name) ?? -1;
}

/** Expressions to which one axis contributes, with the share of each. */
const CONTRIBUTIONS: readonly (readonly (readonly [expression: number, share: number])[])[] = TERMS.flatMap((terms) =>
  terms.map((_, row) =>
    terms.flatMap((term, number) =>
      term.map((name, place): [number, number] => {
        const sign = place === 0 ? 1 : -1;
        const share = terms.length === 1 ? 1 : row > 0 && number > 0 ? -Math.SQRT1_2 : Math.SQRT1_2;
        return [expressionIndex(name), sign * share];
      }),
    ),
  ),
);

/** Axes of a performer's face that are coded: their numbers, ascending. */
export interface Face {
  readonly axes: readonly number[];
}

/** Expressions to which a face's axes contribute. */
export function faceExpressionNames({ axes }: Face): string[] {
  const used = new Set(axes.flatMap((axis) => CONTRIBUTIONS[axis].map(([expression]) => expression)));
  return [...used].sort((a, b) => a - b).map((expression) => EXPRESSIONS[expression]);
}

/** Weights of `EXPRESSIONS`: 0..1, gaze in radians. `face` says which of them are known. */
export interface FacePose {
  readonly face: Face;
  readonly weights: Float64Array;
}

/** Write the weights for the values of a face's axes into `out`. */
export function faceExpressions({ axes }: Face, values: Float64Array, out: Float64Array): void {
  out.fill(0);
  axes.forEach((axis, at) => {
    for (const [expression, share] of CONTRIBUTIONS[axis]) out[expression] += share * values[at];
  });
  const gaze = out.length - GAZE.length;
  for (let expression = 0; expression < out.length; expression++) {
    const [lowest, highest] = expression < gaze ? [0, 1] : [-MAX_GAZE_RAD, MAX_GAZE_RAD];
    out[expression] = Math.min(Math.max(out[expression], lowest), highest);
  }
}
