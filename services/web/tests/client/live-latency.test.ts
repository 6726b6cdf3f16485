import { expect, test } from "vitest";
import { LATENCY_WINDOW_MS, LiveLatency } from "../../src/client/live-latency";

test("the age is the median of the last seconds", () => {
  const latency = new LiveLatency();
  expect(latency.ageMs(0)).toBeNull();
  [60_000, 400_000, 80_000].forEach((ageUs, nth) => latency.add(0, ageUs, nth * 33));
  expect(latency.ageMs(100)).toBe(80);
  for (let nth = 0; nth < 10; nth++) latency.add(0, 100_000, LATENCY_WINDOW_MS + 100 + nth);
  expect(latency.ageMs(LATENCY_WINDOW_MS + 110)).toBe(100);
  expect(latency.ageMs(2 * LATENCY_WINDOW_MS + 110)).toBeNull();
});

test("of several performers, the slowest counts", () => {
  const latency = new LiveLatency();
  latency.add(0, 60_000, 0);
  latency.add(2, 140_000, 0);
  latency.add(2, 140_000, LATENCY_WINDOW_MS);
  expect(latency.ageMs(LATENCY_WINDOW_MS)).toBe(140);
  latency.add(0, 200_000, LATENCY_WINDOW_MS + 1);
  expect(latency.ageMs(LATENCY_WINDOW_MS + 1)).toBe(200);
  latency.clear();
  expect(latency.ageMs(LATENCY_WINDOW_MS + 1)).toBeNull();
});
