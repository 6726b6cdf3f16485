import { expect, test } from "vitest";
import { channelWeights } from "../src/codec/channel-weights";
import { DamagedBlock } from "../src/codec/errors";
import { unpackSkeletonDescription } from "../src/codec/skeleton-description";
import { decodeBase64, loadVectors } from "./golden-vectors";

interface SkeletonVectors {
  valid: {
    why: string;
    dancer: string;
    offsets: number[];
    tips: number[];
    reference: number[];
    weights: number[][][];
  }[];
  invalid: { why: string; dancer: string }[];
}

const golden = loadVectors<SkeletonVectors>("skeletons");

function expectClose(actual: Float64Array, expected: number[]): void {
  expect(actual).toHaveLength(expected.length);
  expected.forEach((value, i) => expect(Math.abs(actual[i] - value)).toBeLessThan(1e-9));
}

test.each(golden.valid)("decodes: $why", ({ dancer, offsets, tips, reference, weights }) => {
  const skeleton = unpackSkeletonDescription(decodeBase64(dancer));
  expectClose(skeleton.figure.offsets, offsets);
  expectClose(skeleton.figure.tips, tips);
  expectClose(skeleton.reference, reference);
  expectClose(channelWeights(skeleton.figure, skeleton.reference).weights, weights.flat(2));
});

test.each(golden.invalid)("refuses: $why", ({ dancer }) => {
  expect(() => unpackSkeletonDescription(decodeBase64(dancer))).toThrow(DamagedBlock);
});
