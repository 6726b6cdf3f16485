import fc from "fast-check";
import { describe, expect, test } from "vitest";
import { OneEuro, smoothingSettings } from "../../src/input/one-euro";
import { loadVectors } from "../golden-vectors";

interface Golden {
  settings: { min_cutoff: number; beta: number; derivative_cutoff: number };
  samples: { seconds: number; values: number[]; filtered: number[] }[];
}

const SETTINGS = { minCutoff: 1.5, beta: 0.7, derivativeCutoff: 1 };
// No negative zero: it is filtered to positive zero.
const value = fc.double({ min: -100, max: 100, noNaN: true }).map((one) => one + 0);
const step = fc.double({ min: 0, max: 0.5, noNaN: true });

/** Return reproducible numbers of mean 0 and variance 1. */
function noise(count: number): number[] {
  let seed = 12345;
  const uniform = () => (seed = (seed * 1103515245 + 12345) % 2147483648) / 2147483648;
  return Array.from(
    { length: count },
    () => Math.sqrt(-2 * Math.log(1 - uniform())) * Math.cos(2 * Math.PI * uniform()),
  );
}

const variance = (values: number[]) => values.reduce((sum, one) => sum + one * one, 0) / values.length;

test.each(loadVectors<Golden[]>("one_euro"))("reproduces golden values with %o", ({ settings, samples }) => {
  const { min_cutoff, beta, derivative_cutoff } = settings;
  const filter = new OneEuro(samples[0].values.length, {
    minCutoff: min_cutoff,
    beta,
    derivativeCutoff: derivative_cutoff,
  });
  for (const { seconds, values, filtered } of samples) {
    filter.filter(values, seconds).forEach((one, axis) => expect(one).toBeCloseTo(filtered[axis], 12));
  }
});

describe("the One-Euro filter", () => {
  test("passes a constant bit for bit at any times", () => {
    fc.assert(
      fc.property(fc.tuple(value, value, value), fc.array(step, { maxLength: 30 }), (constant, steps) => {
        const filter = new OneEuro(3, SETTINGS);
        let seconds = 0;
        for (const interval of steps) expect([...filter.filter(constant, (seconds += interval))]).toEqual(constant);
      }),
    );
  });

  test("removes most noise at rest, and more with a lower cutoff", () => {
    const samples = noise(4000);
    const left = [4, 1, 0.25].map((minCutoff) => {
      const filter = new OneEuro(1, { minCutoff, beta: 0, derivativeCutoff: 1 });
      return variance(samples.map((one, i) => filter.filter([one], i / 60)[0]).slice(600));
    });
    expect(left[0]).toBeLessThan(0.5 * variance(samples));
    expect(left[1]).toBeLessThan(left[0]);
    expect(left[2]).toBeLessThan(left[1]);
    expect(left[2]).toBeLessThan(0.03);
  });

  test("follows a step without overshoot within seven time constants", () => {
    fc.assert(
      fc.property(
        value,
        value,
        fc.double({ min: 0.2, max: 5, noNaN: true }),
        fc.array(fc.double({ min: 1e-3, max: 0.1, noNaN: true }), { minLength: 5, maxLength: 60 }),
        (from, to, minCutoff, steps) => {
          const filter = new OneEuro(1, { minCutoff, beta: 0.5, derivativeCutoff: 1 });
          filter.filter([from], 0);
          let [seconds, last] = [0, from];
          const settled = 7 / (2 * Math.PI * minCutoff);
          for (const interval of [...steps, ...Array.from({ length: 200 }, () => settled / 200)]) {
            const [now] = filter.filter([to], (seconds += interval));
            expect(Math.abs(to - now)).toBeLessThanOrEqual(Math.abs(to - last) + 1e-12);
            expect((to - now) * (to - from)).toBeGreaterThanOrEqual(-1e-9);
            last = now;
          }
          expect(Math.abs(to - last)).toBeLessThan(1.1e-3 * Math.abs(to - from) + 1e-9);
        },
      ),
    );
  });

  test("lags less at higher speed if beta is positive", () => {
    const lag = (beta: number) => {
      const filter = new OneEuro(1, { minCutoff: 1, beta, derivativeCutoff: 1 });
      return 2 - Array.from({ length: 121 }, (_, i) => filter.filter([i / 60], i / 60)[0])[120];
    };
    expect(lag(10)).toBeLessThan(0.25 * lag(0));
  });

  test("keeps the direction of a movement", () => {
    const filter = new OneEuro(2, SETTINGS);
    for (const [i, one] of noise(200).entries()) {
      const [x, y] = filter.filter([3 * one, 4 * one], i / 60);
      expect(4 * x - 3 * y).toBeCloseTo(0, 9);
    }
  });

  test("replaces samples with the same or an earlier time", () => {
    fc.assert(
      fc.property(
        fc.array(fc.tuple(value, value, fc.double({ min: 1e-3, max: 0.2, noNaN: true })), {
          minLength: 1,
          maxLength: 20,
        }),
        (samples) => {
          const [twice, once] = [new OneEuro(1, SETTINGS), new OneEuro(1, SETTINGS)];
          let seconds = 0;
          for (const [stale, fresh, interval] of samples) {
            seconds += interval;
            twice.filter([stale], seconds);
            expect(twice.filter([fresh], seconds - interval / 2)).toEqual(once.filter([fresh], seconds));
          }
        },
      ),
    );
  });

  test("forgets on reset, and rejects invalid samples", () => {
    const filter = new OneEuro(2, SETTINGS);
    filter.filter([1, 1], 0);
    filter.reset();
    expect([...filter.filter([5, 6], 0.01)]).toEqual([5, 6]);
    expect(() => filter.filter([NaN, 1], 1)).toThrow(RangeError);
    expect(() => filter.filter([1], 1)).toThrow("2 finite numbers");
    expect(() => filter.filter([1, 2], Infinity)).toThrow(RangeError);
    expect([...filter.filter([5, 6], 0.02)]).toEqual([5, 6]);
  });
});

test("the amount of smoothing is none at 0 and lowers the cutoff", () => {
  expect(smoothingSettings(0, 1)).toBeNull();
  expect(smoothingSettings(NaN, 1)).toBeNull();
  const cutoffs = [0.01, 0.5, 1, 2].map((wish) => smoothingSettings(wish, 1)?.minCutoff ?? 0);
  expect(cutoffs[0]).toBeCloseTo(7.8, 1);
  expect(cutoffs[1]).toBeLessThan(cutoffs[0]);
  expect(cutoffs[2]).toBeCloseTo(0.6, 9);
  expect(cutoffs[3]).toBe(cutoffs[2]);
});
