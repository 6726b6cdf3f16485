import * as fc from "fast-check";
import { expect, test } from "vitest";
import { DeviceClock } from "../../src/audio/device-clock";

test("is not ready before the first sample", () => {
  const clock = new DeviceClock();
  expect(clock.hasSample).toBe(false);
  clock.addSample(1, 5_000, 5_010);
  expect(clock.hasSample).toBe(true);
  expect(clock.frameAt(5_010)).toBeCloseTo(48_480);
  expect(clock.timeOfFrame(48_480, 5_010)).toBeCloseTo(5_010);
  clock.clear();
  expect(clock.hasSample).toBe(false);
});

test("averages noisy samples without stepping", () => {
  const errors = fc.array(fc.double({ min: -12, max: 12, noNaN: true }), { minLength: 60, maxLength: 60 });
  fc.assert(
    fc.property(errors, (offsets) => {
      const clock = new DeviceClock();
      let last = -Infinity;
      offsets.forEach((ms, index) => {
        const now = 4_000 + index * 50;
        clock.addSample((now - 4_000) / 1000, now + ms, now);
        for (const between of [0, 25, 49]) {
          const frame = clock.frameAt(now + between);
          expect(frame).toBeGreaterThan(last);
          last = frame;
          expect(Math.abs(clock.timeOfFrame(frame, now + between) - now - between)).toBeLessThan(1e-6);
        }
      });
      expect(Math.abs(last / 48 - (offsets.length * 50 - 1))).toBeLessThan(12);
    }),
  );
});

test("follows a device that paused", () => {
  const clock = new DeviceClock();
  for (let index = 0; index < 100; index++) {
    const now = index * 50;
    clock.addSample((now - (index > 40 ? 80 : 0)) / 1000, now, now);
  }
  expect(clock.frameAt(4_950) / 48).toBeCloseTo(4_870, 0);
});

test("ignores a single outlier", () => {
  const clock = new DeviceClock();
  for (let index = 0; index < 30; index++)
    clock.addSample(index / 20, index * 50 + (index === 20 ? 400 : 0), index * 50);
  expect(clock.frameAt(1_450) / 48).toBeCloseTo(1_450, 6);
});

test("accepts the next sample some milliseconds after the last", () => {
  const clock = new DeviceClock();
  expect(clock.isSampleDue(0)).toBe(true);
  clock.addSample(1, 5_000, 5_000);
  expect([clock.isSampleDue(5_000), clock.isSampleDue(5_011), clock.isSampleDue(5_012)]).toEqual([false, false, true]);
  clock.clear();
  expect(clock.isSampleDue(5_001)).toBe(true);
});
