import { expect, test } from "vitest";
import { decodeCoefficients, durationLevel } from "../../src/codec/coefficients";
import { DamagedBlock } from "../../src/codec/errors";
import {
  CHANNEL_AXES,
  FEATURE_COUNT,
  FREQUENCY_CLASSES,
  HAZARD_ROWS,
  HIDDEN_UNITS,
  loadShippedPrior,
  parsePrior,
  SIGN_CONTEXTS,
  UNARY_DECISIONS,
} from "../../src/codec/prior";
import type { BlockVectors } from "../golden-motion";
import { decodeBase64, loadVectors } from "../golden-vectors";
import { encodeBits } from "./range-encoder";

const { tracks, valid } = loadVectors<BlockVectors>("blocks");

test.each(valid)("golden head and coefficients: $frames frames at step $step", (vector) => {
  const { block_frames: usual, fps } = tracks[vector.track];
  const { frames, step, heading, count, q } = decodeCoefficients(
    loadShippedPrior(),
    decodeBase64(vector.block),
    usual,
    fps,
  );
  expect([frames, step, heading]).toEqual([vector.frames, vector.step, vector.heading]);
  expect(count * 57).toBe(vector.q.length);
  expect([...q]).toEqual(vector.q);
});

test("the golden blocks reach escapes, sizes with low bits, every axis and blocks without any", () => {
  const sizes = valid.map(({ q }) => q.reduce((most, value) => Math.max(most, Math.abs(value)), 0));
  expect(Math.max(...sizes)).toBeGreaterThan(2 ** 19);
  expect(sizes).toContain(0);
});

test("a block's duration in sixteenths of a second", () => {
  expect([durationLevel(30, 30), durationLevel(1, 1000), durationLevel(1000, 1e-3), durationLevel(40, 59.94)]).toEqual([
    65, 0, 192, 57,
  ]);
});

/** A prior whose every scale is `scale`, and every sign and hazard `probability`, or those of each table. */
function priorWithScale(scale: number, probability: number, tables = [probability, probability, probability]) {
  const rows = (count: number, length: number, value: number) =>
    Array.from({ length: count }, () => new Array<number>(length).fill(value));
  return parsePrior({
    linear: rows(FREQUENCY_CLASSES, FEATURE_COUNT, 0),
    bias: rows(FREQUENCY_CLASSES, CHANNEL_AXES, scale << 8),
    hidden: rows(HIDDEN_UNITS, FEATURE_COUNT, 0),
    hidden_bias: rows(HIDDEN_UNITS, CHANNEL_AXES, 0),
    hidden_class: rows(HIDDEN_UNITS, FREQUENCY_CLASSES, 0),
    out: rows(HIDDEN_UNITS, FREQUENCY_CLASSES, 0),
    hazard: tables.flatMap((each) => rows(HAZARD_ROWS, UNARY_DECISIONS, each)),
    sign: rows(FREQUENCY_CLASSES, SIGN_CONTEXTS, probability),
  });
}

const number = (value: number, bits: number) =>
  Array.from({ length: bits }, (_, i) => ({ bit: (value >> (bits - 1 - i)) & 1, probability: 16384 }));
/** A head of 30 frames as usual, step 90 and heading -5. */
const headerOf = (count: number) => [
  { bit: 1, probability: 32440 },
  { bit: 0, probability: 512 },
  ...number(90, 8),
  ...number(27, 6),
  ...number(count, 5),
];
const header = headerOf(1);
const ones = (count: number, probability: number) => new Array(count).fill({ bit: 1, probability });

test("the largest size there can be is above 2^31, and right", () => {
  const bits = [
    ...header,
    ...ones(UNARY_DECISIONS, 9000),
    ...ones(19, 16384),
    { bit: 0, probability: 16384 },
    ...number(2 ** 19 - 1, 19),
    ...number(2 ** 11 - 1, 11),
    { bit: 1, probability: 9000 },
    ...new Array(56).fill([{ bit: 0, probability: 9000 }, ...number(0, 11)]).flat(),
  ];
  const { q, step, heading } = decodeCoefficients(priorWithScale(3584, 9000), encodeBits(bits), 30, 30);
  expect([step, heading]).toEqual([90, -5]);
  expect([...q]).toEqual([-((2 ** 20 - 1 + UNARY_DECISIONS - 1) * 2 ** 11 + 2 ** 11 - 1), ...new Array(56).fill(0)]);
});

test("each class of frequencies has the hazards of its table", () => {
  const tables = [9000, 20000, 30000];
  const count = 18;
  // of every frequency three sizes of one, plus
  const bits = [
    ...headerOf(count),
    ...Array.from({ length: 19 * count }, (_, i) => {
      const k = i % count,
        probability = tables[k < 3 ? 0 : k < 9 ? 1 : 2];
      const one = [
        { bit: 1, probability },
        { bit: 0, probability },
        { bit: 0, probability: 11000 },
      ];
      return [...one, ...one, ...one];
    }).flat(),
  ];
  expect([...decodeCoefficients(priorWithScale(0, 11000, tables), encodeBits(bits), 30, 30).q]).toEqual(
    new Array(57 * count).fill(1),
  );
});

test("an escape of twenty ones is refused", () => {
  const bits = [...header, ...ones(UNARY_DECISIONS, 9000), ...ones(20, 16384)];
  expect(() => decodeCoefficients(priorWithScale(0, 9000), encodeBits(bits), 30, 30)).toThrow("longer than 20 bits");
});

test("no bytes say every frequency that bits can, which are more than 30 frames have", () => {
  const none = new Uint8Array(0);
  expect(() => decodeCoefficients(loadShippedPrior(), none, 30, 30)).toThrow("31 frequencies for 30 frames");
  expect(() => decodeCoefficients(loadShippedPrior(), none, 31, 30)).toThrow(DamagedBlock);
});
