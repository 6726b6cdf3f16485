/**
 * What the coder expects of human motion before it has seen any (`proto/SPEC.md`, Prior): integers, the same as the Python
 * room's, from the same file, laid out in the order in which they are read.
 */

import shippedValues from "../../../bunraku/codec/prior.json";
import { CHANNEL_COUNT } from "../motion/skeleton";

/** Features of a frequency that its three axes share; `FEATURES` - `SHARED` more are each axis's own. */
export const SHARED = 24;
export const FEATURES = 32;
export const HIDDEN = 8;
/** Sums of a coefficient: the linear one, then one for each hidden unit. */
export const SUMS = 1 + HIDDEN;
export const CLASSES = 7;
/** Scales of a table of hazards: 2^-7 .. 2^4.75 in quarter octaves. */
export const ROWS = 48;
/** Of each class the table of hazards: its sizes are spread alike. */
export const HAZARD_OF: readonly number[] = [0, 0, 0, 1, 1, 2, 2];
const TABLES = 3;
/** Decisions "larger than this?" before an escape. */
export const UNARY = 18;
/** Sign contexts of a class. */
export const SIGNS = 15;
export const AXES = 3 * CHANNEL_COUNT;

/** The network from features to a scale, the hazards of each scale and the signs' odds: probabilities of a 1 in 1/32768. */
export interface Prior {
  /** What a feature adds to each sum: [class][feature][sum]. */
  readonly weights: Float64Array;
  /** What each sum starts at: [class][axis of a channel][sum]. */
  readonly biases: Float64Array;
  /** [class][hidden unit] */
  readonly out: Int32Array;
  /** [table][row][decision] */
  readonly hazard: Int32Array;
  /** [class][context] */
  readonly sign: Int32Array;
}

const SHAPES = {
  linear: [CLASSES, FEATURES], bias: [CLASSES, AXES], hidden: [HIDDEN, FEATURES], hidden_bias: [HIDDEN, AXES],
  hidden_class: [HIDDEN, CLASSES], out: [HIDDEN, CLASSES], hazard: [TABLES * ROWS, UNARY], sign: [CLASSES, SIGNS],
} as const;

/** A prior as it stands in JSON: rows of integers by name. */
export type PriorValues = Readonly<Record<keyof typeof SHAPES, readonly (readonly number[])[]>>;

/** The prior of `values`; throws where a shape is wrong. */
export function readPrior(values: PriorValues): Prior {
  for (const [name, [rows, columns]] of Object.entries(SHAPES)) {
    const array = values[name as keyof PriorValues];
    if (array.length !== rows || array.some((row) => row.length !== columns)) {
      throw new Error(`a prior's ${name} has ${rows} rows of ${columns} numbers`);
    }
  }
  const { linear, bias, hidden, hidden_bias: hiddenBias, hidden_class: hiddenClass, out, hazard, sign } = values;
  const weights = new Float64Array(CLASSES * FEATURES * SUMS);
  const biases = new Float64Array(CLASSES * AXES * SUMS);
  const outs = new Int32Array(CLASSES * HIDDEN);
  for (let z = 0, weight = 0, start = 0; z < CLASSES; z++) {
    for (let i = 0; i < FEATURES; i++) {
      weights[weight++] = linear[z][i];
      for (let unit = 0; unit < HIDDEN; unit++) weights[weight++] = hidden[unit][i];
    }
    for (let i = 0; i < AXES; i++) {
      biases[start++] = bias[z][i];
      for (let unit = 0; unit < HIDDEN; unit++) biases[start++] = hiddenBias[unit][i] + hiddenClass[unit][z];
    }
    for (let unit = 0; unit < HIDDEN; unit++) outs[z * HIDDEN + unit] = out[unit][z];
  }
  return { weights, biases, out: outs, hazard: Int32Array.from(hazard.flat()), sign: Int32Array.from(sign.flat()) };
}

let known: Prior | null = null;

/** The prior that every stream of `bunraku.motion/2` is coded with. */
export function shippedPrior(): Prior {
  return (known ??= readPrior(shippedValues));
}
