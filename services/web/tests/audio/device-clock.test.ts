import * as fc from "fast-check";
import { expect, test } from "vitest";
import { DeviceClock } from "../../src/audio/device-clock";

test("until the device has told of anything it is not ready", () => {
  const heard = new DeviceClock();
  expect(heard.hasSample).toBe(false);
  heard.addSample(1, 5_000, 5_010);
  expect(heard.hasSample).toBe(true);
  expect(heard.frameAt(5_010)).toBeCloseTo(48_480);
  expect(heard.timeOfFrame(48_480, 5_010)).toBeCloseTo(5_010);
  heard.clear();
  expect(heard.hasSample).toBe(false);
});

test("tellings that are wrong by some milliseconds say the time to a few, and it never steps", () => {
  const wrong = fc.array(fc.double({ min: -12, max: 12, noNaN: true }), { minLength: 60, maxLength: 60 });
  fc.assert(
    fc.property(wrong, (all) => {
      const heard = new DeviceClock();
      let last = -Infinity;
      all.forEach((ms, nth) => {
        const now = 4_000 + nth * 50;
        heard.addSample((now - 4_000) / 1000, now + ms, now);
        for (const between of [0, 25, 49]) {
          const frame = heard.frameAt(now + between);
          expect(frame).toBeGreaterThan(last);
          last = frame;
          expect(Math.abs(heard.timeOfFrame(frame, now + between) - now - between)).toBeLessThan(1e-6);
        }
      });
      expect(Math.abs(last / 48 - (all.length * 50 - 1))).toBeLessThan(12);
    }),
  );
});

test("a device that stood still for a while is followed", () => {
  const heard = new DeviceClock();
  for (let nth = 0; nth < 100; nth++) {
    const now = nth * 50;
    heard.addSample((now - (nth > 40 ? 80 : 0)) / 1000, now, now);
  }
  expect(heard.frameAt(4_950) / 48).toBeCloseTo(4_870, 0);
});

test("one wrong telling among right ones changes nothing", () => {
  const heard = new DeviceClock();
  for (let nth = 0; nth < 30; nth++) heard.addSample(nth / 20, nth * 50 + (nth === 20 ? 400 : 0), nth * 50);
  expect(heard.frameAt(1_450) / 48).toBeCloseTo(1_450, 6);
});

test("the device is due to be asked again some milliseconds after it has told", () => {
  const heard = new DeviceClock();
  expect(heard.isSampleDue(0)).toBe(true);
  heard.addSample(1, 5_000, 5_000);
  expect([heard.isSampleDue(5_000), heard.isSampleDue(5_011), heard.isSampleDue(5_012)]).toEqual([false, false, true]);
  heard.clear();
  expect(heard.isSampleDue(5_001)).toBe(true);
});
