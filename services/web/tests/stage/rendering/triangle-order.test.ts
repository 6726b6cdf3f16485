import { PlaneGeometry } from "three";
import { expect, test } from "vitest";
import { buildPuppetGeometry } from "../../../src/stage/puppet/puppet-geometry";
import { orderTriangles } from "../../../src/stage/rendering/triangle-order";
import { createOtherFigure } from "../puppet/figures";

/** Return how often SwiftShader computes four corners for these triangles, which it draws in batches of 128. */
function countComputations(indices: ArrayLike<number>): number {
  const cache = new Int32Array(64).fill(-1);
  let count = 0;
  for (let at = 0; at < indices.length; at++) {
    if (cache[indices[at] % 64] === indices[at]) continue;
    count++;
    const batchEnd = Math.min(indices.length, (Math.floor(at / 384) + 1) * 384);
    for (let nth = 3; nth >= 0; nth--) {
      const corner = indices[Math.min(at + nth, batchEnd - 1)];
      cache[corner % 64] = corner;
    }
  }
  return count;
}

const triangles = (indices: ArrayLike<number>) =>
  Array.from({ length: indices.length / 3 }, (_, at) => [0, 1, 2].map((corner) => indices[3 * at + corner]).join());

test("all triangles stay, with the same winding", () => {
  const { index } = new PlaneGeometry(1, 1, 7, 5);
  const { array } = index!;
  expect(triangles(orderTriangles(array)).sort()).toEqual(triangles(array).sort());
});

test("triangles without a common corner come first", () => {
  expect(orderTriangles([0, 1, 2, 1, 3, 2, 4, 5, 6])).toEqual([0, 1, 2, 4, 5, 6, 1, 3, 2]);
});

test("a grid takes about half of the computations", () => {
  const { array } = new PlaneGeometry(1, 1, 56, 44).index!;
  expect(countComputations(orderTriangles(array)) / countComputations(array)).toBeLessThan(0.52);
});

test("the coarse puppet takes about half of the computations that it would take in the order of its grids", () => {
  const { array } = buildPuppetGeometry(createOtherFigure(), "coarse").index!;
  expect(countComputations(array) / (array.length / 3)).toBeLessThan(0.29);
});
