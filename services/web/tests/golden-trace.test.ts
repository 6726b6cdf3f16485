import { expect, test } from "vitest";
import { MOTION_LAYOUT } from "../src/codec/channel-layout";
import { decodeCoefficients, durationLevel } from "../src/codec/coefficients";
import { ContextModel } from "../src/codec/context-model";
import { loadShippedPrior } from "../src/codec/prior";
import { RangeDecoder } from "../src/codec/range-coder";
import { unpackSkeletonDescription } from "../src/codec/skeleton-description";
import { decodeBase64, loadVectors } from "./golden-vectors";

type Decision = [probability: number, bit: number, range: number, code: number];

interface TraceVectors {
  block: {
    block: string;
    block_frames: number;
    fps: number;
    frames: number;
    step: number;
    heading: number;
    count: number;
    q: number[];
    coefficients: { channel: number; frequency: number; axis: number; features: number[]; e: number; q: number }[];
    decisions: Decision[];
  };
  skeleton: { dancer: string; grid: number; numbers: { value: number }[]; decisions: Decision[] };
}

const { block, skeleton } = loadVectors<TraceVectors>("trace");

/** Decodes with the recorded probabilities; the bits must be the recorded ones. */
function expectDecisions(data: Uint8Array, decisions: Decision[]): void {
  const decoder = new RangeDecoder(data);
  for (const [probability, bit, range, code] of decisions) {
    expect(decoder).toMatchObject({ range, low: code });
    expect(decoder.decodeBit(probability)).toBe(bit);
  }
}

test("the decisions of the traced block and skeleton are those of the range decoder", () => {
  expectDecisions(decodeBase64(block.block), block.decisions);
  expectDecisions(decodeBase64(skeleton.dancer).subarray(1), skeleton.decisions);
});

test("the traced block decodes to the recorded header and coefficients", () => {
  const { frames, step, heading, count, q } = decodeCoefficients(
    loadShippedPrior(),
    decodeBase64(block.block),
    block.block_frames,
    block.fps,
  );
  expect({ frames, step, heading, count, q: [...q] }).toEqual({
    frames: block.frames,
    step: block.step,
    heading: block.heading,
    count: block.count,
    q: block.q,
  });
});

test("features and scales are those recorded for each coefficient", () => {
  const context = new ContextModel(
    loadShippedPrior(),
    MOTION_LAYOUT,
    block.count,
    block.step,
    durationLevel(block.frames, block.fps),
  );
  const { features } = context as unknown as { features: Float64Array };
  block.coefficients.forEach(({ channel, frequency, axis, features: recorded, e, q }) => {
    if (axis === 0) context.computeSharedSums(channel, frequency);
    expect(context.predictScale(channel, axis, frequency)).toBe(e);
    expect([...features]).toEqual(recorded);
    context.updateMagnitude(channel, axis, frequency, Math.abs(q));
    if (axis < 2) return;
    context.finishFrequency(channel, frequency);
    if (frequency === block.count - 1) context.finishChannel(channel);
  });
});

test("the traced skeleton description decodes to the recorded lengths", () => {
  const { figure } = unpackSkeletonDescription(decodeBase64(skeleton.dancer));
  const unit = 1e-4 * 2 ** skeleton.grid;
  figure.offsets.forEach((offset, i) => expect(offset).toBeCloseTo(skeleton.numbers[i].value * unit, 12));
});
