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

test.each(valid)("golden header and coefficients: $frames frames at step $step", (vector) => {
  const { block_frames: nominalFrames, fps } = tracks[vector.track];
  const { frames, step, heading, count, q } = decodeCoefficients(
    loadShippedPrior(),
    decodeBase64(vector.block),
    nominalFrames,
    fps,
  );
  expect([frames, step, heading]).toEqual([vector.frames, vector.step, vector.heading]);
  expect(count * 57).toBe(vector.q.length);
  expect([...q]).toEqual(vector.q);
});

test("golden blocks contain escapes, large magnitudes and a block of zeros", () => {
  const magnitudes = valid.map(({ q }) => q.reduce((largest, value) => Math.max(largest, Math.abs(value)), 0));
  expect(Math.max(...magnitudes)).toBeGreaterThan(2 ** 19);
  expect(magnitudes).toContain(0);
});

test("duration level is that of sixteenths of a second", () => {
  expect([durationLevel(30, 30), durationLevel(1, 1000), durationLevel(1000, 1e-3), durationLevel(40, 59.94)]).toEqual([
    65, 0, 192, 57,
  ]);
});

/** Returns a prior with one scale everywhere, and one probability, or one per hazard table. */
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
    hazard: tables.flatMap((hazard) => rows(HAZARD_ROWS, UNARY_DECISIONS, hazard)),
    sign: rows(FREQUENCY_CLASSES, SIGN_CONTEXTS, probability),
  });
}

const evenBits = (value: number, bits: number) =>
  Array.from({ length: bits }, (_, i) => ({ bit: (value >> (bits - 1 - i)) & 1, probability: 16384 }));
/** Returns the header of a block of the nominal 30 frames, step 90 and heading -5. */
const createHeader = (count: number) => [
  { bit: 1, probability: 32440 },
  { bit: 0, probability: 512 },
  ...evenBits(90, 8),
  ...evenBits(27, 6),
  ...evenBits(count, 5),
];
const header = createHeader(1);
const ones = (count: number, probability: number) => new Array(count).fill({ bit: 1, probability });

test("largest possible magnitude, above 2^31, is decoded exactly", () => {
  const bits = [
    ...header,
    ...ones(UNARY_DECISIONS, 9000),
    ...ones(19, 16384),
    { bit: 0, probability: 16384 },
    ...evenBits(2 ** 19 - 1, 19),
    ...evenBits(2 ** 11 - 1, 11),
    { bit: 1, probability: 9000 },
    ...new Array(56).fill([{ bit: 0, probability: 9000 }, ...evenBits(0, 11)]).flat(),
  ];
  const { q, step, heading } = decodeCoefficients(priorWithScale(3584, 9000), encodeBits(bits), 30, 30);
  expect([step, heading]).toEqual([90, -5]);
  expect([...q]).toEqual([-((2 ** 20 - 1 + UNARY_DECISIONS - 1) * 2 ** 11 + 2 ** 11 - 1), ...new Array(56).fill(0)]);
});

test("each frequency class uses its hazard table", () => {
  const tables = [9000, 20000, 30000];
  const count = 18;
  // every frequency has three coefficients of +1
  const bits = [
    ...createHeader(count),
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

test("escape of twenty ones is refused", () => {
  const bits = [...header, ...ones(UNARY_DECISIONS, 9000), ...ones(20, 16384)];
  expect(() => decodeCoefficients(priorWithScale(0, 9000), encodeBits(bits), 30, 30)).toThrow("20 or more unary bits");
});

test("empty block is refused: it decodes to more frequencies than frames", () => {
  const empty = new Uint8Array(0);
  expect(() => decodeCoefficients(loadShippedPrior(), empty, 30, 30)).toThrow("31 frequencies for 30 frames");
  expect(() => decodeCoefficients(loadShippedPrior(), empty, 31, 30)).toThrow(DamagedBlock);
});
