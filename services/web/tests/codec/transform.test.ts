import * as fc from "fast-check";
import { expect, test } from "vitest";
import { cosineBasis } from "../../src/codec/transform";

test("cosines are orthonormal over the frames", () => {
  fc.assert(
    fc.property(fc.integer({ min: 1, max: 60 }), fc.nat(59), fc.nat(59), (frames, i, j) => {
      const [a, b] = [i % frames, j % frames];
      const row = new Float64Array(frames);
      let product = 0;
      for (let t = 0; t < frames; t++) {
        cosineBasis(row, frames, frames, t);
        product += row[a] * row[b];
      }
      expect(product).toBeCloseTo(a === b ? 1 : 0, 10);
    }),
  );
});

test("cosines equal their definition at any instant", () => {
  const row = new Float64Array(1000);
  for (const t of [-0.5, 0, 17.3, 999.5]) {
    cosineBasis(row, 1000, 1000, t);
    for (const k of [1, 7, 500, 999]) {
      expect(row[k]).toBeCloseTo(Math.sqrt(2 / 1000) * Math.cos((Math.PI * (t + 0.5) * k) / 1000), 12);
    }
    expect(row[0]).toBeCloseTo(Math.sqrt(1 / 1000), 15);
  }
});
