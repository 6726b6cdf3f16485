import fc from "fast-check";
import { describe, expect, test } from "vitest";
import { blinkAt, blinkWeight, CLOSING_S, OPENING_S } from "../../src/motion/blink";

const STEP_S = 0.01;

/** Return the times at which the eyes of a performer begin to close. */
function findStarts(seed: number, from: number, duration: number): number[] {
  const starts: number[] = [];
  let before = blinkWeight(from, seed);
  for (let n = 1; n * STEP_S < duration; n++) {
    const closed = blinkWeight(from + n * STEP_S, seed);
    if (before === 0 && closed > 0) starts.push(n * STEP_S);
    before = closed;
  }
  return starts;
}

describe("a blink", () => {
  test("closes faster than it opens", () => {
    expect(blinkAt(-0.01)).toBe(0);
    expect(blinkAt(0)).toBe(0);
    expect(blinkAt(CLOSING_S / 2)).toBeCloseTo(0.5);
    expect(blinkAt(CLOSING_S)).toBe(1);
    expect(blinkAt(CLOSING_S + OPENING_S / 2)).toBeCloseTo(0.5);
    expect(blinkAt(CLOSING_S + OPENING_S)).toBe(0);
    expect(OPENING_S).toBeGreaterThan(CLOSING_S);
  });

  test("has a weight of 0..1 at any time, the same each time", () => {
    fc.assert(
      fc.property(fc.double({ min: -1e10, max: 1e10, noNaN: true }), fc.integer(), (seconds, seed) => {
        const closed = blinkWeight(seconds, seed);
        expect(closed).toBeGreaterThanOrEqual(0);
        expect(closed).toBeLessThanOrEqual(1);
        expect(blinkWeight(seconds, seed)).toBe(closed);
      }),
    );
    expect(blinkAt(Number.NaN)).toBe(0);
  });
});

describe("blinks of a performer", () => {
  test("come 2 to 8 seconds after each other, and a few are double", () => {
    const intervals = [0, 1, 2, 3].flatMap((seed) => {
      const starts = findStarts(seed, 1.7e9, 600);
      return starts.slice(1).map((start, n) => start - starts[n]);
    });
    const single = intervals.filter((interval) => interval > 1);
    const rest = single.toSorted((a, b) => a - b);
    // The second of a double blink shortens the next interval.
    expect(rest[0]).toBeGreaterThan(1.6);
    expect(rest.at(-1)).toBeLessThan(8);
    const mean = single.reduce((sum, interval) => sum + interval) / single.length;
    expect(mean).toBeGreaterThan(3.4);
    expect(mean).toBeLessThan(4.8);
    // Longer intervals are further from the median than shorter ones.
    expect(mean).toBeGreaterThan(rest[rest.length >> 1]);
    const doubles = intervals.length - single.length;
    expect(doubles / single.length).toBeGreaterThan(0.05);
    expect(doubles / single.length).toBeLessThan(0.3);
  });

  test("are those of no other performer", () => {
    const starts = [0, 1, 2, 3].map((seed) => findStarts(seed, 1.7e9, 120));
    for (const one of starts)
      for (const other of starts)
        if (one !== other)
          expect(one.filter((start) => other.some((at) => Math.abs(at - start) < 0.05)).length).toBeLessThan(
            one.length / 4,
          );
  });
});
