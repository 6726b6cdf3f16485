/**
 * Prior of the context model: fixed integers, trained on human motion (`proto/codec.md`, 2.11). They come from the same
 * file as in Python, and are stored in the order in which the decoder reads them.
 */

import shippedValues from "../../../../proto/prior.json";
import { CHANNEL_COUNT } from "../motion/skeleton";

/** Features of a frequency that its three axes share; the others belong to each axis. */
export const SHARED_FEATURES = 24;
export const FEATURE_COUNT = 32;
export const HIDDEN_UNITS = 8;
/** Sums of a coefficient: the linear one, then one per hidden unit. */
export const SUM_COUNT = 1 + HIDDEN_UNITS;
export const FREQUENCY_CLASSES = 7;
/** Rows of a hazard table: scales from 2^-7 to 2^4.75 in quarter octaves. */
export const HAZARD_ROWS = 48;
/** Hazard table of each frequency class. Classes with similar distributions of magnitudes share a table. */
export const HAZARD_TABLE_OF: readonly number[] = [0, 0, 0, 1, 1, 2, 2];
const HAZARD_TABLES = 3;
/** Decisions "magnitude greater than v?" before an escape. */
export const UNARY_DECISIONS = 18;
/** Sign contexts of a class. */
export const SIGN_CONTEXTS = 15;
export const CHANNEL_AXES = 3 * CHANNEL_COUNT;

/** Network from features to a scale, hazard tables and sign probabilities; probabilities of a 1 in 1/32768. */
export interface Prior {
  /** Weights of the features in each sum: [class][feature][sum]. */
  readonly weights: Float64Array;
  /** Initial values of the sums: [class][channel axis][sum]. */
  readonly biases: Float64Array;
  /** [class][hidden unit] */
  readonly out: Int32Array;
  /** [table][row][decision] */
  readonly hazard: Int32Array;
  /** [class][context] */
  readonly sign: Int32Array;
}

const SHAPES = {
  linear: [FREQUENCY_CLASSES, FEATURE_COUNT],
  bias: [FREQUENCY_CLASSES, CHANNEL_AXES],
  hidden: [HIDDEN_UNITS, FEATURE_COUNT],
  hidden_bias: [HIDDEN_UNITS, CHANNEL_AXES],
  hidden_class: [HIDDEN_UNITS, FREQUENCY_CLASSES],
  out: [HIDDEN_UNITS, FREQUENCY_CLASSES],
  hazard: [HAZARD_TABLES * HAZARD_ROWS, UNARY_DECISIONS],
  sign: [FREQUENCY_CLASSES, SIGN_CONTEXTS],
} as const;

/** A prior in JSON: rows of integers by name. */
export type PriorValues = Readonly<Record<keyof typeof SHAPES, readonly (readonly number[])[]>>;

/** Returns the prior of JSON values. Throws an Error for a wrong shape. */
export function parsePrior(values: PriorValues): Prior {
  for (const [name, [rows, columns]] of Object.entries(SHAPES)) {
    const array = values[name as keyof PriorValues];
    if (array.length !== rows || array.some((row) => row.length !== columns)) {
      throw new Error(`Invalid prior: ${name} must have ${rows} rows of ${columns} numbers.`);
    }
  }
  const { linear, bias, hidden, hidden_bias: hiddenBias, hidden_class: hiddenClass, out, hazard, sign } = values;
  const weights = new Float64Array(FREQUENCY_CLASSES * FEATURE_COUNT * SUM_COUNT);
  const biases = new Float64Array(FREQUENCY_CLASSES * CHANNEL_AXES * SUM_COUNT);
  const outs = new Int32Array(FREQUENCY_CLASSES * HIDDEN_UNITS);
  for (let z = 0, weight = 0, initial = 0; z < FREQUENCY_CLASSES; z++) {
    for (let i = 0; i < FEATURE_COUNT; i++) {
      weights[weight++] = linear[z][i];
      for (let unit = 0; unit < HIDDEN_UNITS; unit++) weights[weight++] = hidden[unit][i];
    }
    for (let i = 0; i < CHANNEL_AXES; i++) {
      biases[initial++] = bias[z][i];
      for (let unit = 0; unit < HIDDEN_UNITS; unit++) biases[initial++] = hiddenBias[unit][i] + hiddenClass[unit][z];
    }
    for (let unit = 0; unit < HIDDEN_UNITS; unit++) outs[z * HIDDEN_UNITS + unit] = out[unit][z];
  }
  return { weights, biases, out: outs, hazard: Int32Array.from(hazard.flat()), sign: Int32Array.from(sign.flat()) };
}

let shippedPriorCache: Prior | null = null;

/** Returns the prior with which every stream of `bunraku.motion/2` is coded. */
export function loadShippedPrior(): Prior {
  return (shippedPriorCache ??= parsePrior(shippedValues));
}
