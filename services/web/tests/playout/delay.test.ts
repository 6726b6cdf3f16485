import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import { MAX_DELAY_US, MAX_GROWTH_RATE, PlayoutDelay } from "../../src/playout/delay";

/** Interval of messages, and time from sending until the first frame is needed, microseconds. */
const FRAME_INTERVAL_US = 33_334;
const OVERLAY_LEAD_US = 26_666;

/**
 * Simulate a link with `networkDelay` (microseconds, by message number) for `seconds`. Return the share of messages
 * that arrive too late for the delay in use, from second `after` on, and the final delay.
 */
function lateShare(networkDelay: (nth: number) => number, seconds: number, after: number): [number, number] {
  const delay = new PlayoutDelay();
  const arrivals = Array.from({ length: Math.floor((seconds * 1e6) / FRAME_INTERVAL_US) }, (_, nth) => {
    const needed = nth * FRAME_INTERVAL_US + OVERLAY_LEAD_US;
    return { needed, at: nth * FRAME_INTERVAL_US + networkDelay(nth) };
  }).sort((a, b) => a.at - b.at);
  let late = 0,
    all = 0;
  for (const { needed, at } of arrivals) {
    if (at > after * 1e6) {
      all++;
      // the delayed clock has passed the time at which the message is needed
      if (at - delay.at(at) > needed) late++;
    }
    delay.addLateness(at - needed, at);
  }
  return [late / all, delay.at(seconds * 1e6)];
}

/** Return a reproducible pseudo-random number in 0..1. */
function noise(nth: number): number {
  const x = Math.sin(nth * 12.9898) * 43758.5453;
  return x - Math.floor(x);
}

describe("delay on a link", () => {
  test("that is fast is zero", () => {
    expect(lateShare((nth) => 2_000 + 3_000 * noise(nth), 10, 0)).toEqual([0, 0]);
  });

  test.each([
    ["slow", () => 90_000],
    ["jittery", (nth: number) => 40_000 + 80_000 * noise(nth)],
    ["long-tailed", (nth: number) => 20_000 - 25_000 * Math.log(1 - noise(nth))],
    ["sometimes stalled", (nth: number) => 30_000 + (nth % 40 < 2 ? 120_000 : 0)],
  ])("that is %s lets nearly all messages arrive in time", (_, networkDelay) => {
    const [late, delay] = lateShare(networkDelay, 40, 10);
    expect(late).toBeLessThanOrEqual(0.05);
    expect(delay).toBeGreaterThan(10_000);
    expect(delay).toBeLessThan(160_000);
  });

  test("that recovers returns to zero", () => {
    const [, delay] = lateShare((nth) => (nth < 300 ? 150_000 : 5_000), 70, 0);
    expect(delay).toBeLessThan(1_000);
  });
});

test("old message sent to a joining viewer is ignored", () => {
  const delay = new PlayoutDelay();
  delay.addLateness(90_000, 0);
  for (let nth = 1; nth < 60; nth++) delay.addLateness(-20_000, nth * FRAME_INTERVAL_US);
  for (let nth = 0; nth < 60; nth++) expect(delay.at(nth * FRAME_INTERVAL_US)).toBe(0);
});

test("delay stays without messages", () => {
  const delay = new PlayoutDelay();
  for (let nth = 0; nth < 300; nth++) delay.addLateness(50_000, nth * FRAME_INTERVAL_US);
  expect(delay.at(10e6)).toBe(60_000);
  expect(delay.at(3_600e6)).toBe(60_000);
});

test("delay never steps and stays within its bounds", () => {
  const arrival = fc.tuple(fc.integer({ min: 0, max: 200_000 }), fc.integer({ min: -100_000, max: 900_000 }));
  fc.assert(
    fc.property(fc.array(arrival, { minLength: 30, maxLength: 200 }), (messages) => {
      const delay = new PlayoutDelay();
      let local = 0,
        before = 0;
      for (const [elapsed, late] of messages) {
        local += elapsed;
        const delayUs = delay.at(local);
        expect(Math.abs(delayUs - before)).toBeLessThanOrEqual(MAX_GROWTH_RATE * elapsed + 1e-6);
        expect(delayUs).toBeGreaterThanOrEqual(0);
        expect(delayUs).toBeLessThanOrEqual(MAX_DELAY_US);
        delay.addLateness(late, local);
        expect(delay.at(local)).toBeCloseTo(delayUs, 6);
        before = delayUs;
      }
    }),
  );
});
