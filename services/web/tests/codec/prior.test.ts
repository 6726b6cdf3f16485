import { expect, test } from "vitest";
import values from "../../../../proto/prior.json";
import {
  CHANNEL_AXES,
  FEATURE_COUNT,
  FREQUENCY_CLASSES,
  HAZARD_ROWS,
  HAZARD_TABLE_OF,
  HIDDEN_UNITS,
  loadShippedPrior,
  parsePrior,
  SIGN_CONTEXTS,
  SUM_COUNT,
  UNARY_DECISIONS,
} from "../../src/codec/prior";

test("integers of the shipped prior are stored in reading order", () => {
  const { weights, biases, out, hazard, sign } = loadShippedPrior();
  for (let z = 0; z < FREQUENCY_CLASSES; z++) {
    for (let i = 0; i < FEATURE_COUNT; i++) {
      const offset = (z * FEATURE_COUNT + i) * SUM_COUNT;
      expect([...weights.subarray(offset, offset + SUM_COUNT)]).toEqual([
        values.linear[z][i],
        ...values.hidden.map((unit) => unit[i]),
      ]);
    }
    for (let i = 0; i < CHANNEL_AXES; i++) {
      const offset = (z * CHANNEL_AXES + i) * SUM_COUNT;
      const units = values.hidden_bias.map((unit, j) => unit[i] + values.hidden_class[j][z]);
      expect([...biases.subarray(offset, offset + SUM_COUNT)]).toEqual([values.bias[z][i], ...units]);
    }
    expect([...out.subarray(z * HIDDEN_UNITS, (z + 1) * HIDDEN_UNITS)]).toEqual(values.out.map((unit) => unit[z]));
  }
  expect([...hazard]).toEqual(values.hazard.flat());
  expect([...sign]).toEqual(values.sign.flat());
  expect([hazard.length, sign.length]).toEqual([
    (Math.max(...HAZARD_TABLE_OF) + 1) * HAZARD_ROWS * UNARY_DECISIONS,
    FREQUENCY_CLASSES * SIGN_CONTEXTS,
  ]);
  expect(HAZARD_TABLE_OF.length).toBe(FREQUENCY_CLASSES);
});

test("sums of the shipped prior cannot overflow 32 bits", () => {
  const { weights, biases, out } = loadShippedPrior();
  const largestFeature = 255;
  for (let z = 0; z < FREQUENCY_CLASSES; z++) {
    for (let sum = 0; sum < SUM_COUNT; sum++) {
      let largest = 0;
      for (let i = 0; i < FEATURE_COUNT; i++)
        largest += largestFeature * Math.abs(weights[(z * FEATURE_COUNT + i) * SUM_COUNT + sum]);
      for (let i = 0; i < CHANNEL_AXES; i++)
        expect(largest + Math.abs(biases[(z * CHANNEL_AXES + i) * SUM_COUNT + sum])).toBeLessThan(2 ** 31);
    }
  }
  for (const weight of out) expect(Math.abs(weight) * 32767).toBeLessThan(2 ** 31);
});

test("probabilities of the shipped prior are between 0 and 1", () => {
  const { hazard, sign } = loadShippedPrior();
  for (const probability of [...hazard, ...sign]) {
    expect(probability).toBeGreaterThan(0);
    expect(probability).toBeLessThan(32768);
  }
});

test("prior of a wrong shape is refused", () => {
  expect(() => parsePrior({ ...values, hazard: values.hazard.slice(1) })).toThrow(
    "hazard must have 144 rows of 18 numbers",
  );
  expect(() => parsePrior({ ...values, sign: values.sign.map((row) => row.slice(1)) })).toThrow("sign");
});
