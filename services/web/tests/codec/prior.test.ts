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

test("every number of the shipped prior stands where it is read", () => {
  const { weights, biases, out, hazard, sign } = loadShippedPrior();
  for (let z = 0; z < FREQUENCY_CLASSES; z++) {
    for (let i = 0; i < FEATURE_COUNT; i++) {
      const at = (z * FEATURE_COUNT + i) * SUM_COUNT;
      expect([...weights.subarray(at, at + SUM_COUNT)]).toEqual([
        values.linear[z][i],
        ...values.hidden.map((unit) => unit[i]),
      ]);
    }
    for (let i = 0; i < CHANNEL_AXES; i++) {
      const at = (z * CHANNEL_AXES + i) * SUM_COUNT;
      const units = values.hidden_bias.map((unit, j) => unit[i] + values.hidden_class[j][z]);
      expect([...biases.subarray(at, at + SUM_COUNT)]).toEqual([values.bias[z][i], ...units]);
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

test("no sum of the shipped prior can pass 32 bits, whatever the features", () => {
  const { weights, biases, out } = loadShippedPrior();
  const largestFeature = 255;
  for (let z = 0; z < FREQUENCY_CLASSES; z++) {
    for (let sum = 0; sum < SUM_COUNT; sum++) {
      let most = 0;
      for (let i = 0; i < FEATURE_COUNT; i++)
        most += largestFeature * Math.abs(weights[(z * FEATURE_COUNT + i) * SUM_COUNT + sum]);
      for (let i = 0; i < CHANNEL_AXES; i++)
        expect(most + Math.abs(biases[(z * CHANNEL_AXES + i) * SUM_COUNT + sum])).toBeLessThan(2 ** 31);
    }
  }
  for (const weight of out) expect(Math.abs(weight) * 32767).toBeLessThan(2 ** 31);
});

test("all its probabilities are above none and below all", () => {
  const { hazard, sign } = loadShippedPrior();
  for (const probability of [...hazard, ...sign]) {
    expect(probability).toBeGreaterThan(0);
    expect(probability).toBeLessThan(32768);
  }
});

test("a prior of another shape is refused by name", () => {
  expect(() => parsePrior({ ...values, hazard: values.hazard.slice(1) })).toThrow(
    "a prior's hazard has 144 rows of 18 numbers",
  );
  expect(() => parsePrior({ ...values, sign: values.sign.map((row) => row.slice(1)) })).toThrow("sign");
});
