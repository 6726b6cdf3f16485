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
    const made = Float64Array.from(all);
    for (const at of [0, 4, 8]) normalise(made, at);
    return made;
  });

function maxDifference(a: Float64Array, b: Float64Array): number {
  return Math.max(...[0, 4, 8].map((at) => rotationAngle(a, at, b, at)));
}

test("what is shown changes over without a step, and is the new in the end", () => {
  fc.assert(
    fc.property(joints, joints, joints, fc.integer({ min: 0, max: 40 }), (one, two, three, again) => {
      const correction = new Correction();
      correction.begin(one, 0, two, 0);
      let goal = two,
        before = one;
      for (let step = 0; step < 80; step++) {
        if (step === again) {
          correction.begin(goal, 0, three, 0);
          goal = three;
        }
        const shown = goal.slice();
        correction.apply(shown, 0);
        // minimum jerk goes at 1.875 times the mean speed at its fastest, and no difference is beyond half a turn
        expect(maxDifference(shown, before)).toBeLessThan((1.9 * Math.PI * 0.01) / CORRECTION_S + 1e-6);
        before = shown;
        correction.advance(0.01);
      }
      expect(correction.isActive).toBe(false);
      expect(before).toEqual(goal);
    }),
  );
});
