import { expect, test } from "vitest";
import values from "../../../bunraku/codec/prior.json";
import { AXES, CLASSES, FEATURES, HAZARD_OF, HIDDEN, readPrior, ROWS, SIGNS, shippedPrior, SUMS, UNARY } from "../../src/codec/prior";

test("every number of the shipped prior stands where it is read", () => {
  const { weights, biases, out, hazard, sign } = shippedPrior();
  for (let z = 0; z < CLASSES; z++) {
    for (let i = 0; i < FEATURES; i++) {
      const at = (z * FEATURES + i) * SUMS;
      expect([...weights.subarray(at, at + SUMS)]).toEqual([values.linear[z][i], ...values.hidden.map((unit) => unit[i])]);
    }
    for (let i = 0; i < AXES; i++) {
      const at = (z * AXES + i) * SUMS;
      const units = values.hidden_bias.map((unit, j) => unit[i] + values.hidden_class[j][z]);
      expect([...biases.subarray(at, at + SUMS)]).toEqual([values.bias[z][i], ...units]);
    }
    expect([...out.subarray(z * HIDDEN, (z + 1) * HIDDEN)]).toEqual(values.out.map((unit) => unit[z]));
  }
  expect([...hazard]).toEqual(values.hazard.flat());
  expect([...sign]).toEqual(values.sign.flat());
  expect([hazard.length, sign.length]).toEqual([(Math.max(...HAZARD_OF) + 1) * ROWS * UNARY, CLASSES * SIGNS]);
  expect(HAZARD_OF.length).toBe(CLASSES);
});

test("no sum of the shipped prior can pass 32 bits, whatever the features", () => {
  const { weights, biases, out } = shippedPrior();
  const largestFeature = 255;
  for (let z = 0; z < CLASSES; z++) {
    for (let sum = 0; sum < SUMS; sum++) {
      let most = 0;
      for (let i = 0; i < FEATURES; i++) most += largestFeature * Math.abs(weights[(z * FEATURES + i) * SUMS + sum]);
      for (let i = 0; i < AXES; i++) expect(most + Math.abs(biases[(z * AXES + i) * SUMS + sum])).toBeLessThan(2 ** 31);
    }
  }
  for (const weight of out) expect(Math.abs(weight) * 32767).toBeLessThan(2 ** 31);
});

test("all its probabilities are above none and below all", () => {
  const { hazard, sign } = shippedPrior();
  for (const probability of [...hazard, ...sign]) {
    expect(probability).toBeGreaterThan(0);
    expect(probability).toBeLessThan(32768);
  }
});

test("a prior of another shape is refused by name", () => {
  expect(() => readPrior({ ...values, hazard: values.hazard.slice(1) })).toThrow("a prior's hazard has 144 rows of 18 numbers");
  expect(() => readPrior({ ...values, sign: values.sign.map((row) => row.slice(1)) })).toThrow("sign");
});
