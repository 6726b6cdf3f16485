import * as fc from "fast-check";
import { expect, test } from "vitest";
import { channelWeights } from "../../src/codec/weights";
import { type BlockVectors, goldenTrack } from "../golden";
import { vectors } from "../vectors";

test("the golden weights to 1e-12", () => {
  vectors<BlockVectors>("blocks").tracks.forEach((golden, which) => {
    const { weights } = goldenTrack(which).weights;
    golden.weights.flat(2).forEach((weight, i) => expect(Math.abs(weights[i] - weight)).toBeLessThan(1e-12));
  });
});

test("of any figure, even one without size, weights are symmetric and their inverses undo them", () => {
  const metres = fc.oneof(fc.constant(0), fc.double({ min: -3.3, max: 3.3, noNaN: true }));
  const lengths = fc.array(metres, { minLength: 54, maxLength: 54 });
  fc.assert(
    fc.property(lengths, lengths, (offsets, tips) => {
      const { weights, inverses } = channelWeights({ offsets: Float64Array.from(offsets), tips: Float64Array.from(tips) });
      for (let c = 0; c < 19; c++) {
        for (let i = 0; i < 3; i++) {
          for (let j = 0; j < 3; j++) {
            let product = 0;
            for (let k = 0; k < 3; k++) product += weights[c * 9 + i * 3 + k] * inverses[c * 9 + k * 3 + j];
            expect(product).toBeCloseTo(i === j ? 1 : 0, 10);
            expect(weights[c * 9 + i * 3 + j]).toBe(weights[c * 9 + j * 3 + i]);
          }
        }
      }
    }),
  );
});

test("a root's square is the contract's sum where all limbs are one straight line", () => {
  // only the sacroiliac has length: one arm of N = 11 points, straight up
  const offsets = new Float64Array(54), tips = new Float64Array(54);
  offsets[4] = 0.5;
  const { weights } = channelWeights({ offsets, tips });
  const across = Math.sqrt(0.06 ** 2 + 11 ** 0.45 * 0.25) * 0.88, along = 0.06 * 0.88;
  [across, 0, 0, 0, along, 0, 0, 0, across].forEach((wanted, i) => expect(weights[9 + i]).toBeCloseTo(wanted, 12));
});
