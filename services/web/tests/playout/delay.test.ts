import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import { MAX_DELAY_US, MAX_GROWTH_RATE, PlayoutDelay } from "../../src/playout/delay";

/** A message goes out so often, and the first of its frames is needed so long after, microseconds. */
const FRAME_INTERVAL_US = 33_334;
const OVERLAY_LEAD_US = 26_666;

/**
 * A line whose way takes what `way` says (microseconds, of the message's number): the messages that came after the delay in use
 * said they were needed, from second `after` on, as a part of all; and the delay in the end.
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
      // it is shown from the local time on at which the delayed clock is there
      if (at - delay.at(at) > needed) late++;
    }
    delay.addLateness(at - needed, at);
  }
  return [late / all, delay.at(seconds * 1e6)];
}

/** Even numbers in 0..1 that look like none, the same in every run (Weyl's sequence, mixed). */
function noise(nth: number): number {
  const x = Math.sin(nth * 12.9898) * 43758.5453;
  return x - Math.floor(x);
}

describe("on a line", () => {
  test("that is quick there is none", () => {
    expect(lateShare((nth) => 2_000 + 3_000 * noise(nth), 10, 0)).toEqual([0, 0]);
  });

  test.each([
    ["slow", () => 90_000],
    ["jittery", (nth: number) => 40_000 + 80_000 * noise(nth)],
    ["of long tails", (nth: number) => 20_000 - 25_000 * Math.log(1 - noise(nth))],
    ["that stalls now and then", (nth: number) => 30_000 + (nth % 40 < 2 ? 120_000 : 0)],
  ])("that is %s, nearly all is there when it is shown", (_, way) => {
    const [late, delay] = lateShare(way, 40, 10);
    expect(late).toBeLessThanOrEqual(0.05);
    expect(delay).toBeGreaterThan(10_000);
    expect(delay).toBeLessThan(160_000);
  });

  test("that gets well again it is gone after a while", () => {
    const [, delay] = lateShare((nth) => (nth < 300 ? 150_000 : 5_000), 70, 0);
    expect(delay).toBeLessThan(1_000);
  });
});

test("of old news sent to who joins nothing is heard", () => {
  const delay = new PlayoutDelay();
  delay.addLateness(90_000, 0);
  for (let nth = 1; nth < 60; nth++) delay.addLateness(-20_000, nth * FRAME_INTERVAL_US);
  for (let nth = 0; nth < 60; nth++) expect(delay.at(nth * FRAME_INTERVAL_US)).toBe(0);
});

test("with nothing pulled it stays", () => {
  const delay = new PlayoutDelay();
  for (let nth = 0; nth < 300; nth++) delay.addLateness(50_000, nth * FRAME_INTERVAL_US);
  expect(delay.at(10e6)).toBe(60_000);
  expect(delay.at(3_600e6)).toBe(60_000);
});

test("it never steps, and stays within its bounds", () => {
  const came = fc.tuple(fc.integer({ min: 0, max: 200_000 }), fc.integer({ min: -100_000, max: 900_000 }));
  fc.assert(
    fc.property(fc.array(came, { minLength: 30, maxLength: 200 }), (messages) => {
      const delay = new PlayoutDelay();
      let local = 0,
        before = 0;
      for (const [passed, late] of messages) {
        local += passed;
        const shown = delay.at(local);
        expect(Math.abs(shown - before)).toBeLessThanOrEqual(MAX_GROWTH_RATE * passed + 1e-6);
        expect(shown).toBeGreaterThanOrEqual(0);
        expect(shown).toBeLessThanOrEqual(MAX_DELAY_US);
        delay.addLateness(late, local);
        expect(delay.at(local)).toBeCloseTo(shown, 6);
        before = shown;
      }
    }),
  );
});
