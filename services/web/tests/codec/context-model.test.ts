import * as fc from "fast-check";
import { expect, test } from "vitest";
import {
  ContextModel,
  FREQUENCY_CLASS_OF,
  MAX_SCALE,
  MIN_SCALE,
  RELATIVE_CHANNELS,
  signContext,
} from "../../src/codec/context-model";
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
import { JOINTS } from "../../src/motion/skeleton";

/** A channel's name: its joint's, or the root's position. */
const channelName = (channel: number) => (channel === 0 ? "position" : channel === 19 ? "none" : JOINTS[channel - 1]);

test("relatives are those of the body", () => {
  const of = (channel: number) =>
    [RELATIVE_CHANNELS.parent, RELATIVE_CHANNELS.mirror, RELATIVE_CHANNELS.grandparent].map((which) =>
      channelName(which[channel]),
    );
  expect(of(0)).toEqual(["none", "none", "none"]);
  expect(of(1)).toEqual(["position", "none", "none"]);
  expect(of(2)).toEqual(["humanoid_root", "humanoid_root", "position"]);
  expect(of(JOINTS.indexOf("r_knee") + 1)).toEqual(["r_hip", "l_knee", "sacroiliac"]);
  expect(of(JOINTS.indexOf("l_elbow") + 1)).toEqual(["l_shoulder", "l_shoulder", "vl5"]);
  for (const relatives of Object.values(RELATIVE_CHANNELS)) {
    relatives.forEach((relative, channel) => expect(relative < channel || relative === 19).toBe(true));
  }
});

test("classes of frequencies", () => {
  expect([0, 1, 2, 3, 4, 5, 8, 9, 15, 16, 512].map((k) => FREQUENCY_CLASS_OF[k])).toEqual([
    0, 1, 2, 3, 3, 4, 4, 5, 5, 6, 6,
  ]);
});

/** The scale by the words of the contract, from all sizes and how many of them are decoded. */
function referenceScale(
  prior: PriorValues,
  size: (c: number, a: number, k: number) => number,
  at: [number, number, number],
  count: number,
  step: number,
  length: number,
): number {
  const [c, a, k] = at;
  const decoded = (channel: number, axis: number, f: number) =>
    channel < 19 &&
    channel >= 0 &&
    f >= 0 &&
    f < count &&
    (channel < c || (channel === c && (f < k || (f === k && axis < a))));
  const L = (channel: number, axis: number, f: number) =>
    decoded(channel, axis, f) ? magnitudeLevel(size(channel, axis, f)) : 0;
  // the mean of a frequency counts once its three axes are decoded
  const M = (channel: number, f: number) =>
    decoded(channel, 2, f) ? Math.floor((L(channel, 0, f) + L(channel, 1, f) + L(channel, 2, f)) / 3) : 0;
  const sum = (n: number, term: (i: number) => number) =>
    Array.from({ length: n }, (_, i) => term(i)).reduce((x, y) => x + y, 0);
  const T = (f: number) => sum(c, (channel) => M(channel, f));
  const [p, m, g] = [RELATIVE_CHANNELS.parent[c], RELATIVE_CHANNELS.mirror[c], RELATIVE_CHANNELS.grandparent[c]];
  const d = Math.max(c, 1);
  const kin = (r: number) => [
    M(r, k),
    M(r, k - 1),
    M(r, k + 1),
    Math.floor((M(r, k + 2) + M(r, k + 3) + M(r, k + 4)) / 3),
  ];
  const f = [
    M(c, k - 1),
    M(c, k - 2),
    M(c, k - 3),
    ...kin(p),
    ...kin(m),
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
    length,
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

const row = (length: number, most: number) =>
  fc.array(fc.integer({ min: -most, max: most }), { minLength: length, maxLength: length });
const rows = (count: number, length: number, most: number) =>
  fc.array(row(length, most), { minLength: count, maxLength: count });
const anyPrior: fc.Arbitrary<PriorValues> = fc.record({
  linear: rows(FREQUENCY_CLASSES, FEATURE_COUNT, 1500),
  bias: rows(FREQUENCY_CLASSES, CHANNEL_AXES, 300_000),
  hidden: rows(HIDDEN_UNITS, FEATURE_COUNT, 3000),
  hidden_bias: rows(HIDDEN_UNITS, CHANNEL_AXES, 300_000),
  hidden_class: rows(HIDDEN_UNITS, FREQUENCY_CLASSES, 300_000),
  out: rows(HIDDEN_UNITS, FREQUENCY_CLASSES, 6000),
  hazard: rows(3 * HAZARD_ROWS, UNARY_DECISIONS, 1),
  sign: rows(FREQUENCY_CLASSES, SIGN_CONTEXTS, 1),
});

test("the scale is the definition's for any prior and any sizes", () => {
  const sizes = fc.infiniteStream(fc.oneof(fc.constant(0), fc.nat(3), fc.nat(100_000)));
  fc.assert(
    fc.property(
      anyPrior,
      sizes,
      fc.integer({ min: 1, max: 22 }),
      fc.nat(255),
      fc.nat(192),
      (values, stream, count, step, length) => {
        const drawn = Array.from({ length: CHANNEL_AXES * count }, () => stream.next().value as number);
        const size = (c: number, a: number, k: number) => drawn[(c * 3 + a) * count + k];
        const contexts = new ContextModel(parsePrior(values), count, step, length);
        let seen = 0;
        for (let channel = 0; channel < 19; channel++) {
          for (let k = 0; k < count; k++) {
            contexts.computeSharedSums(channel, k);
            for (let axis = 0; axis < 3; axis++) {
              const scale = contexts.predictScale(channel, axis, k);
              // the definition is slow: every seventh coefficient
              if (seen++ % 7 === 0)
                expect(scale).toBe(referenceScale(values, size, [channel, axis, k], count, step, length));
              contexts.updateMagnitude(channel, axis, k, size(channel, axis, k));
            }
            contexts.finishFrequency(channel, k);
          }
          contexts.finishChannel(channel);
        }
      },
    ),
    { numRuns: 15 },
  );
});

test("a scale keeps within its ends", () => {
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
  for (const [bias, wanted] of [
    [1 << 28, MAX_SCALE],
    [-(1 << 28), MIN_SCALE],
    [-1, -1],
    [511, 1],
  ]) {
    const contexts = new ContextModel(
      parsePrior({ ...values, bias: flat(FREQUENCY_CLASSES, CHANNEL_AXES, bias) }),
      1,
      0,
      0,
    );
    contexts.computeSharedSums(0, 0);
    expect(contexts.predictScale(0, 0, 0)).toBe(wanted);
  }
});

test("a sign's context is of the second and fourth frequency before, never of the first", () => {
  const q = Float64Array.of(0, 9, 9, -7, 1, 0, 2 ** 31);
  const contexts = [0, 1, 2, 3, 4, 5, 6].map((k) => signContext(q, k, k));
  const context = (near: number, far: number) => 3 * (near + 2) + far + 1;
  expect(contexts).toEqual([
    context(0, 0),
    context(0, 0),
    context(0, 0),
    context(2, 0),
    context(2, 0),
    context(-2, 1),
    context(1, 1),
  ]);
});
