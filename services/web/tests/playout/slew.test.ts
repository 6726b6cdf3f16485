import * as fc from "fast-check";
import { expect, test } from "vitest";
import { Slew } from "../../src/playout/slew";

const numbers = fc.double({ min: -5e6, max: 5e6, noNaN: true });

test("it starts where it is told to, and comes to its goal", () => {
  const slew = new Slew();
  slew.start(1000, 5000, 100);
  expect(slew.at(50)).toBe(1000);
  expect(slew.at(100)).toBe(1000);
  expect(slew.at(1e9)).toBeCloseTo(5000);
});

test("a new goal is gone to from where it is, and time that it is added to never runs backwards", () => {
  const change = fc.record({ goal: numbers, after: fc.double({ min: 0, max: 1e6, noNaN: true }) });
  fc.assert(
    fc.property(numbers, fc.array(change, { minLength: 1, maxLength: 12 }), (from, changes) => {
      const slew = new Slew();
      slew.start(from, from, 0);
      let local = 0,
        shown = from;
      for (const { goal, after } of changes) {
        for (let step = 1; step <= 20; step++) {
          const at = local + (after * step) / 20;
          const now = at + slew.at(at);
          expect(now).toBeGreaterThanOrEqual(shown - 1e-3);
          shown = now;
        }
        local += after;
        const before = slew.at(local);
        slew.slewTo(goal, local);
        expect(slew.at(local)).toBeCloseTo(before, 3);
      }
    }),
  );
});
