import * as fc from "fast-check";
import { expect, test } from "vitest";
import { MOTION_LAYOUT } from "../../src/codec/channel-layout";
import { ContextModel, FREQUENCY_CLASS_OF, MAX_SCALE, MIN_SCALE, signContext } from "../../src/codec/context-model";
import { magnitudeLevel } from "../../src/codec/magnitude-level";
import {
  CHANNEL_AXES,
  FEATURE_COUNT,
  FREQUENCY_CLASSES,
  HAZARD_ROWS,
  HIDDEN_UNITS,
  type PriorValues,
  parsePrior,
  SIGN_CONTEXTS,
  UNARY_DECISIONS,
} from "../../src/codec/prior";

test("frequency classes", () => {
  expect([0, 1, 2, 3, 4, 5, 8, 9, 15, 16, 512].map((k) => FREQUENCY_CLASS_OF[k])).toEqual([
    0, 1, 2, 3, 3, 4, 4, 5, 5, 6, 6,
  ]);
});

/** Returns the scale as the specification defines it, from all magnitudes. */
function referenceScale(
  prior: PriorValues,
  magnitude: (c: number, a: number, k: number) => number,
  coefficient: [number, number, number],
  count: number,
  step: number,
  durationLevel: number,
): number {
  const [c, a, k] = coefficient;
  const decoded = (channel: number, axis: number, f: number) =>
    channel < 19 &&
    channel >= 0 &&
    f >= 0 &&
    f < count &&
    (channel < c || (channel === c && (f < k || (f === k && axis < a))));
  const L = (channel: number, axis: number, f: number) =>
    decoded(channel, axis, f) ? magnitudeLevel(magnitude(channel, axis, f)) : 0;
  // the mean of a frequency counts when its three axes are decoded
  const M = (channel: number, f: number) =>
    decoded(channel, 2, f) ? Math.floor((L(channel, 0, f) + L(channel, 1, f) + L(channel, 2, f)) / 3) : 0;
  const sum = (n: number, term: (i: number) => number) =>
    Array.from({ length: n }, (_, i) => term(i)).reduce((x, y) => x + y, 0);
  const T = (f: number) => sum(c, (channel) => M(channel, f));
  const [p, m, g] = [MOTION_LAYOUT.parents[c], MOTION_LAYOUT.mirrors[c], MOTION_LAYOUT.grandparents[c]];
  const d = Math.max(c, 1);
  const relativeFeatures = (r: number) => [
    M(r, k),
    M(r, k - 1),
    M(r, k + 1),
    Math.floor((M(r, k + 2) + M(r, k + 3) + M(r, k + 4)) / 3),
  ];
  const f = [
    M(c, k - 1),
    M(c, k - 2),
    M(c, k - 3),
    ...relativeFeatures(p),
    ...relativeFeatures(m),
    M(g, k),
    Math.floor((M(g, k + 1) + M(g, k + 2)) / 2),
    Math.floor(T(k) / d),
    Math.floor(T(k - 1) / d),
    Math.floor(T(k + 1) / d),
    Math.floor((T(k + 2) + T(k + 3) + T(k + 4)) / (3 * d)),
    Math.floor(sum(k, (i) => M(c, i)) / (k + 1)),
    M(c - 1, k),
    M(c - 2, k),
    Math.min(count - k, 63),
    magnitudeLevel(k),
    step,
    durationLevel,
    L(c, a, k - 1),
    L(c, a, k - 2),
    L(c, a, k - 3),
    a > 0 ? L(c, 0, k) : 0,
    a > 1 ? L(c, 1, k) : 0,
    L(p, a, k),
    L(m, a, k),
    L(m, a, k + 1),
  ];
  const z = FREQUENCY_CLASS_OF[k],
    i = 3 * c + a;
  const dot = (weights: readonly number[]) => sum(FEATURE_COUNT, (n) => weights[n] * f[n]);
  let e = Math.floor((prior.bias[z][i] + dot(prior.linear[z])) / 256);
  for (let j = 0; j < HIDDEN_UNITS; j++) {
    const x = prior.hidden_bias[j][i] + prior.hidden_class[j][z] + dot(prior.hidden[j]);
    if (x > 0) e += Math.floor((Math.min(Math.floor(x / 256), 32767) * prior.out[j][z]) / 4096);
  }
  return Math.min(Math.max(e, -1792), 3584);
}

const row = (length: number, limit: number) =>
  fc.array(fc.integer({ min: -limit, max: limit }), { minLength: length, maxLength: length });
const rows = (count: number, length: number, limit: number) =>
  fc.array(row(length, limit), { minLength: count, maxLength: count });
const arbitraryPrior: fc.Arbitrary<PriorValues> = fc.record({
  linear: rows(FREQUENCY_CLASSES, FEATURE_COUNT, 1500),
  bias: rows(FREQUENCY_CLASSES, CHANNEL_AXES, 300_000),
  hidden: rows(HIDDEN_UNITS, FEATURE_COUNT, 3000),
  hidden_bias: rows(HIDDEN_UNITS, CHANNEL_AXES, 300_000),
  hidden_class: rows(HIDDEN_UNITS, FREQUENCY_CLASSES, 300_000),
  out: rows(HIDDEN_UNITS, FREQUENCY_CLASSES, 6000),
  hazard: rows(3 * HAZARD_ROWS, UNARY_DECISIONS, 1),
  sign: rows(FREQUENCY_CLASSES, SIGN_CONTEXTS, 1),
});

test("scale equals its definition for any prior and magnitudes", () => {
  const magnitudes = fc.infiniteStream(fc.oneof(fc.constant(0), fc.nat(3), fc.nat(100_000)));
  fc.assert(
    fc.property(
      arbitraryPrior,
      magnitudes,
      fc.integer({ min: 1, max: 22 }),
      fc.nat(255),
      fc.nat(192),
      (values, stream, count, step, durationLevel) => {
        const drawn = Array.from({ length: CHANNEL_AXES * count }, () => stream.next().value as number);
        const magnitude = (c: number, a: number, k: number) => drawn[(c * 3 + a) * count + k];
        const context = new ContextModel(parsePrior(values), MOTION_LAYOUT, count, step, durationLevel);
        let index = 0;
        for (let channel = 0; channel < 19; channel++) {
          for (let k = 0; k < count; k++) {
            context.computeSharedSums(channel, k);
            for (let axis = 0; axis < 3; axis++) {
              const scale = context.predictScale(channel, axis, k);
              // the definition is slow, so check every seventh coefficient
              if (index++ % 7 === 0)
                expect(scale).toBe(referenceScale(values, magnitude, [channel, axis, k], count, step, durationLevel));
              context.updateMagnitude(channel, axis, k, magnitude(channel, axis, k));
            }
            context.finishFrequency(channel, k);
          }
          context.finishChannel(channel);
        }
      },
    ),
    { numRuns: 15 },
  );
});

test("scale is within its limits", () => {
  const flat = (count: number, length: number, value = 0) =>
    Array.from({ length: count }, () => new Array<number>(length).fill(value));
  const values = {
    linear: flat(FREQUENCY_CLASSES, FEATURE_COUNT),
    hidden: flat(HIDDEN_UNITS, FEATURE_COUNT),
    hidden_bias: flat(HIDDEN_UNITS, CHANNEL_AXES),
    hidden_class: flat(HIDDEN_UNITS, FREQUENCY_CLASSES),
    out: flat(HIDDEN_UNITS, FREQUENCY_CLASSES),
    hazard: flat(3 * HAZARD_ROWS, UNARY_DECISIONS),
    sign: flat(FREQUENCY_CLASSES, SIGN_CONTEXTS),
  };
  for (const [bias, expected] of [
    [1 << 28, MAX_SCALE],
    [-(1 << 28), MIN_SCALE],
    [-1, -1],
    [511, 1],
  ]) {
    const context = new ContextModel(
      parsePrior({ ...values, bias: flat(FREQUENCY_CLASSES, CHANNEL_AXES, bias) }),
      MOTION_LAYOUT,
      1,
      0,
      0,
    );
    context.computeSharedSums(0, 0);
    expect(context.predictScale(0, 0, 0)).toBe(expected);
  }
});

test("sign context depends on two and four frequencies below, never on the lowest", () => {
  const q = Float64Array.of(0, 9, 9, -7, 1, 0, 2 ** 31);
  const contexts = [0, 1, 2, 3, 4, 5, 6].map((k) => signContext(q, k, k));
  const contextOf = (near: number, far: number) => 3 * (near + 2) + far + 1;
  expect(contexts).toEqual([
    contextOf(0, 0),
    contextOf(0, 0),
    contextOf(0, 0),
    contextOf(2, 0),
    contextOf(2, 0),
    contextOf(-2, 1),
    contextOf(1, 1),
  ]);
});
