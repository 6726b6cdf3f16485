import * as fc from "fast-check";
import { expect, test } from "vitest";
import { channelWeights } from "../../src/codec/channel-weights";
import { type BlockVectors, goldenTrack } from "../golden-motion";
import { loadVectors } from "../golden-vectors";
import { arbitraryFigure, arbitraryReference, REST_ROTATIONS } from "./arbitrary-skeleton";

test("golden weights are reproduced to 1e-9", () => {
  loadVectors<BlockVectors>("blocks").tracks.forEach((golden, index) => {
    const { weights } = goldenTrack(index).weights;
    golden.weights.flat(2).forEach((weight, i) => expect(Math.abs(weights[i] - weight)).toBeLessThan(1e-9));
  });
});

/** Returns the product of the matrices of channel `c` in two arrays, the first transposed if asked for. */
function multiplyChannel(a: Float64Array, b: Float64Array, c: number, transposed: boolean): number[] {
  return Array.from({ length: 9 }, (_, i) => {
    const row = Math.floor(i / 3),
      column = i % 3;
    return [0, 1, 2].reduce(
      (sum, k) => sum + a[c * 9 + (transposed ? k * 3 + row : row * 3 + k)] * b[c * 9 + k * 3 + column],
      0,
    );
  });
}

test("inverse weights are inverses for any figure and reference", () => {
  fc.assert(
    fc.property(arbitraryFigure, arbitraryReference, (figure, reference) => {
      const { weights, inverseWeights } = channelWeights(figure, reference);
      for (let c = 0; c < 19; c++) {
        multiplyChannel(weights, inverseWeights, c, false).forEach((value, i) =>
          expect(value).toBeCloseTo(i % 4 === 0 ? 1 : 0, 9),
        );
        multiplyChannel(inverseWeights, weights, c, false).forEach((value, i) =>
          expect(value).toBeCloseTo(i % 4 === 0 ? 1 : 0, 9),
        );
      }
    }),
  );
});

test("reference changes the axes but not the norm of the weights", () => {
  fc.assert(
    fc.property(arbitraryFigure, arbitraryReference, (figure, reference) => {
      const { weights } = channelWeights(figure, reference);
      const { weights: unreferenced } = channelWeights(figure, REST_ROTATIONS);
      for (let c = 0; c < 19; c++) {
        const [square, expected] = [
          multiplyChannel(weights, weights, c, true),
          multiplyChannel(unreferenced, unreferenced, c, true),
        ];
        square.forEach((value, i) =>
          expect(Math.abs(value - expected[i])).toBeLessThan(1e-10 * Math.max(1, ...square)),
        );
      }
    }),
  );
});

test("weights of a single bone are those of the specification", () => {
  // only the sacroiliac has a length: one arm with N = 11 points, straight up
  const offsets = new Float64Array(54),
    tips = new Float64Array(54);
  offsets[4] = 0.5;
  const across = Math.sqrt(0.06 ** 2 + 11 ** 0.45 * 0.25) * 0.88,
    along = 0.06 * 0.88;
  const unreferenced = channelWeights({ offsets, tips }, REST_ROTATIONS).weights;
  [across, 0, 0, 0, along, 0, 0, 0, across].forEach((expected, i) =>
    expect(unreferenced[9 + i]).toBeCloseTo(expected, 12),
  );
  // relative to a quarter turn about x, its own y axis is the figure's forward direction
  const turned = REST_ROTATIONS.slice();
  turned.set([Math.SQRT1_2, Math.SQRT1_2, 0, 0]);
  const { weights } = channelWeights({ offsets, tips }, turned);
  [across, 0, 0, 0, 0, -across, 0, along, 0].forEach((expected, i) => expect(weights[9 + i]).toBeCloseTo(expected, 12));
});
