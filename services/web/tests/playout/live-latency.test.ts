import { expect, test } from "vitest";
import { LATENCY_WINDOW_MS, LiveLatency } from "../../src/playout/live-latency";

test("the age is the median of the last seconds", () => {
  const latency = new LiveLatency();
  expect(latency.ageMs(0)).toBeNull();
  [60_000, 400_000, 80_000].forEach((ageUs, nth) => latency.add(ageUs, nth * 33));
  expect(latency.ageMs(100)).toBe(80);
  for (let nth = 0; nth < 10; nth++) latency.add(100_000, LATENCY_WINDOW_MS + 100 + nth);
  expect(latency.ageMs(LATENCY_WINDOW_MS + 110)).toBe(100);
  expect(latency.ageMs(2 * LATENCY_WINDOW_MS + 110)).toBeNull();
});
