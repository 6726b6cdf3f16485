import * as fc from "fast-check";
import { expect, test } from "vitest";
import { channelWeights } from "../../src/codec/channel-weights";
import { type BlockVectors, goldenTrack } from "../golden-motion";
import { loadVectors } from "../golden-vectors";
import { arbitraryFigure, arbitraryReference, REST_ROTATIONS } from "./arbitrary-skeleton";

test("the golden weights to 1e-9", () => {
  loadVectors<BlockVectors>("blocks").tracks.forEach((golden, which) => {
    const { weights } = goldenTrack(which).weights;
    golden.weights.flat(2).forEach((weight, i) => expect(Math.abs(weights[i] - weight)).toBeLessThan(1e-9));
  });
});

/** Entries of a product of channel `c` of two arrays of matrices, each perhaps transposed. */
function products(a: Float64Array, b: Float64Array, c: number, transposed: boolean): number[] {
  return Array.from({ length: 9 }, (_, i) => {
    const row = Math.floor(i / 3),
      column = i % 3;
    return [0, 1, 2].reduce(
      (sum, k) => sum + a[c * 9 + (transposed ? k * 3 + row : row * 3 + k)] * b[c * 9 + k * 3 + column],
      0,
    );
  });
}

test("of any figure, even one without size, and any references, inverses undo the weights", () => {
  fc.assert(
    fc.property(arbitraryFigure, arbitraryReference, (of, reference) => {
      const { weights, inverseWeights: inverses } = channelWeights(of, reference);
      for (let c = 0; c < 19; c++) {
        products(weights, inverses, c, false).forEach((value, i) => expect(value).toBeCloseTo(i % 4 === 0 ? 1 : 0, 9));
        products(inverses, weights, c, false).forEach((value, i) => expect(value).toBeCloseTo(i % 4 === 0 ? 1 : 0, 9));
      }
    }),
  );
});

test("references choose the axes, and none of what a turn weighs", () => {
  fc.assert(
    fc.property(arbitraryFigure, arbitraryReference, (of, reference) => {
      const { weights } = channelWeights(of, reference);
      const { weights: standing } = channelWeights(of, REST_ROTATIONS);
      for (let c = 0; c < 19; c++) {
        const [one, other] = [products(weights, weights, c, true), products(standing, standing, c, true)];
        one.forEach((value, i) => expect(Math.abs(value - other[i])).toBeLessThan(1e-10 * Math.max(1, ...one)));
      }
    }),
  );
});

test("a root's square is the contract's sum where all limbs are one straight line", () => {
  // only the sacroiliac has length: one arm of N = 11 points, straight up
  const offsets = new Float64Array(54),
    tips = new Float64Array(54);
  offsets[4] = 0.5;
  const across = Math.sqrt(0.06 ** 2 + 11 ** 0.45 * 0.25) * 0.88,
    along = 0.06 * 0.88;
  const standing = channelWeights({ offsets, tips }, REST_ROTATIONS).weights;
  [across, 0, 0, 0, along, 0, 0, 0, across].forEach((wanted, i) => expect(standing[9 + i]).toBeCloseTo(wanted, 12));
  // told from a quarter turn about x, its own y is the dancer's forward
  const turned = REST_ROTATIONS.slice();
  turned.set([Math.SQRT1_2, Math.SQRT1_2, 0, 0]);
  const { weights } = channelWeights({ offsets, tips }, turned);
  [across, 0, 0, 0, 0, -across, 0, along, 0].forEach((wanted, i) => expect(weights[9 + i]).toBeCloseTo(wanted, 12));
});
