import * as fc from "fast-check";
import { expect, test } from "vitest";
import { FASTEST, Spin } from "../../src/marionette/spin";
import { multiply, rotate } from "../../src/motion/rotation";
import { about, apart, normalise, unit } from "../../src/motion/vector";

const FRAME = 1 / 60;
const part = fc.double({ min: -1, max: 1, noNaN: true });
const orientation = fc.tuple(part, part, part, part).map((parts) => Float64Array.from(parts))
  .filter((q) => Math.hypot(...q) > 0.3).map((q) => (normalise(q, 0), q));
const link = Float64Array.of(0.1, -0.3, 0.05), along = new Float64Array(3);
unit(along, 0, link, 0);

/** The angle between two orientations. */
const angle = (a: Float64Array, b: Float64Array): number =>
  2 * Math.acos(Math.min(Math.abs(a.reduce((sum, value, i) => sum + value * b[i], 0)), 1));

test("a link lies where it is wanted, however it is turned", () => {
  fc.assert(
    fc.property(fc.array(orientation, { minLength: 1, maxLength: 8 }), fc.double({ min: 0, max: 1, noNaN: true }), (all, share) => {
      const spin = new Spin(link, 0), shown = new Float64Array(4), got = new Float64Array(3), there = new Float64Array(3);
      for (const wanted of all) {
        spin.follow(shown, 0, wanted, share, FRAME);
        rotate(got, 0, shown, 0, link, 0);
        rotate(there, 0, wanted, 0, link, 0);
        expect(apart(got, 0, there, 0)).toBeLessThan(1e-7);
      }
    }),
  );
});

test("a jump about itself is gone through at a bounded speed, and ended", () => {
  fc.assert(
    fc.property(orientation, fc.double({ min: -3, max: 3, noNaN: true }), (begin, jump) => {
      const spin = new Spin(link, 0), shown = new Float64Array(4), wanted = new Float64Array(4), before = new Float64Array(4);
      spin.follow(shown, 0, begin, 1, FRAME);
      expect(angle(shown, begin)).toBeLessThan(1e-7);
      about(wanted, 0, along, 0, jump);
      multiply(wanted, 0, begin, 0, wanted, 0);
      const frames = Math.ceil(Math.abs(jump) / (FASTEST * FRAME) + 1e-6);
      for (let frame = 0; frame < frames; frame++) {
        before.set(shown);
        spin.follow(shown, 0, wanted, 1, FRAME);
        expect(angle(before, shown)).toBeLessThan(FASTEST * FRAME + 1e-6);
      }
      expect(spin.behind).toBeCloseTo(0, 12);
      expect(angle(shown, wanted)).toBeLessThan(1e-7);
    }),
  );
});

test("with no share left, and once it has forgotten, it is as wanted", () => {
  fc.assert(
    fc.property(orientation, orientation, (one, other) => {
      const spin = new Spin(link, 0), shown = new Float64Array(4);
      spin.follow(shown, 0, one, 1, FRAME);
      spin.follow(shown, 0, other, 0, FRAME);
      expect(angle(shown, other)).toBeLessThan(1e-7);
      spin.follow(shown, 0, one, 1, 0);
      spin.forget();
      spin.follow(shown, 0, other, 1, FRAME);
      expect(angle(shown, other)).toBeLessThan(1e-7);
    }),
  );
});
