import * as fc from "fast-check";
import { expect, test } from "vitest";
import { Slew } from "../../src/playout/slew";

const numbers = fc.double({ min: -5e6, max: 5e6, noNaN: true });

test("starts at the initial offset and reaches the target", () => {
  const slew = new Slew();
  slew.start(1000, 5000, 100);
  expect(slew.at(50)).toBe(1000);
  expect(slew.at(100)).toBe(1000);
  expect(slew.at(1e9)).toBeCloseTo(5000);
});

test("new target is approached without a step, and time never runs backwards", () => {
  const change = fc.record({ target: numbers, after: fc.double({ min: 0, max: 1e6, noNaN: true }) });
  fc.assert(
    fc.property(numbers, fc.array(change, { minLength: 1, maxLength: 12 }), (from, changes) => {
      const slew = new Slew();
      slew.start(from, from, 0);
      let local = 0,
        presented = from;
      for (const { target, after } of changes) {
        for (let step = 1; step <= 20; step++) {
          const at = local + (after * step) / 20;
          const now = at + slew.at(at);
          expect(now).toBeGreaterThanOrEqual(presented - 1e-3);
          presented = now;
        }
        local += after;
        const before = slew.at(local);
        slew.slewTo(target, local);
        expect(slew.at(local)).toBeCloseTo(before, 3);
      }
    }),
  );
});
