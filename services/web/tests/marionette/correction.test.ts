import * as fc from "fast-check";
import { expect, test } from "vitest";
import { CORRECTION_S, Correction } from "../../src/marionette/correction";
import { normalise } from "../../src/motion/vector";
import { rotationAngle } from "./figure";

const part = fc.double({ min: -1, max: 1, noNaN: true });
const joints = fc
  .array(part, { minLength: 12, maxLength: 12 })
  .filter((all) => [0, 4, 8].every((at) => Math.hypot(...all.slice(at, at + 4)) > 0.1))
  .map((all) => {
    const normalised = Float64Array.from(all);
    for (const at of [0, 4, 8]) normalise(normalised, at);
    return normalised;
  });

function maxDifference(a: Float64Array, b: Float64Array): number {
  return Math.max(...[0, 4, 8].map((at) => rotationAngle(a, at, b, at)));
}

test("correction is continuous and ends at the corrected joints", () => {
  fc.assert(
    fc.property(joints, joints, joints, fc.integer({ min: 0, max: 40 }), (first, second, third, restartStep) => {
      const correction = new Correction();
      correction.begin(first, 0, second, 0);
      let target = second,
        before = first;
      for (let step = 0; step < 80; step++) {
        if (step === restartStep) {
          correction.begin(target, 0, third, 0);
          target = third;
        }
        const shown = target.slice();
        correction.apply(shown, 0);
        // the peak speed of minimum jerk is 1.875 times its mean; differences are at most half a turn
        expect(maxDifference(shown, before)).toBeLessThan((1.9 * Math.PI * 0.01) / CORRECTION_S + 1e-6);
        before = shown;
        correction.advance(0.01);
      }
      expect(correction.isActive).toBe(false);
      expect(before).toEqual(target);
    }),
  );
});
