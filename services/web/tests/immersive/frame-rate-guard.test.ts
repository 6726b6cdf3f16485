import { expect, test } from "vitest";
import { FrameRateGuard } from "../../src/immersive/frame-rate-guard";

/** Return after how many frames the guard finds these too slow, Infinity if never. */
function framesUntilSlow(secondsOf: (frame: number) => number): number {
  const guard = new FrameRateGuard();
  for (let frame = 1; frame <= 1000; frame++) if (guard.add(secondsOf(frame))) return frame;
  return Infinity;
}

test("frames at the rate of a headset are fast enough", () => {
  for (const rate of [72, 80, 90, 120]) expect(framesUntilSlow(() => 1 / rate)).toBe(Infinity);
});

test("half of that rate is found out within a second", () => {
  expect(framesUntilSlow(() => 1 / 36)).toBeLessThanOrEqual(36);
  // Few frames are enough if each takes very long.
  expect(framesUntilSlow(() => 2)).toBeLessThanOrEqual(18);
});

test("single slow frames and pauses do not matter", () => {
  expect(framesUntilSlow((frame) => (frame % 10 === 0 ? 0.2 : 1 / 72))).toBe(Infinity);
  expect(framesUntilSlow((frame) => (frame % 6 === 0 ? 60 : 1 / 72))).toBe(Infinity);
});
