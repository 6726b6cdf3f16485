import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import { Schedule, SLOT_FRAMES, SLOT_US, stageTimeAtEnd } from "../../src/audio/schedule";

/** Slots scheduled ahead of playback. */
const AHEAD = 24;

/**
 * Schedule `minutes` of slots against a viewer clock that drifts by `drift` and deviates by `wobble(t)`; return the
 * errors when heard.
 */
function errors(
  schedule: Schedule,
  minutes: number,
  drift: number,
  wobble: (us: number) => number,
  silent = false,
): number[] {
  const viewerTime = (us: number) => 7e9 + us * (1 + drift);
  const results: number[] = [];
  for (let index = 0; index < minutes * 60 * 16; index++) {
    const heard = index * SLOT_US;
    const estimate = viewerTime(heard) + wobble(heard - AHEAD * SLOT_US);
    schedule.add(index, estimate, silent);
    results.push(schedule.stageAt(index * SLOT_FRAMES)!.time - viewerTime(heard));
    schedule.dropBefore(index - 40);
  }
  return results;
}

describe("sync with the viewer's clock", () => {
  test("does not drift at any device speed", () => {
    fc.assert(
      fc.property(fc.double({ min: -500e-6, max: 500e-6, noNaN: true }), (drift) => {
        const results = errors(new Schedule(), 3, drift, () => 0);
        expect(Math.max(...results.map(Math.abs))).toBeLessThan(8e3);
        const late = results.slice(-160);
        expect(Math.max(...late) - Math.min(...late)).toBeLessThan(100);
      }),
      { numRuns: 20 },
    );
  });

  test("does not follow every fluctuation of the clock", () => {
    const schedule = new Schedule();
    const results = errors(schedule, 2, 0, (us) => 30e3 * Math.sin(us / 0.4e6));
    expect(Math.max(...results.slice(160).map(Math.abs))).toBeLessThan(36e3);
    expect(schedule.last?.run).toBe(1);
  });

  test("corrects an error of 100 ms slowly in half a minute", () => {
    const schedule = new Schedule();
    const results = errors(schedule, 1, 0, (us) => (us > 1e6 ? 100e3 : 0));
    expect(schedule.last?.run).toBe(1);
    expect(results.at(-1)).toBeGreaterThan(97e3);
    expect(results[16 * 32]).toBeGreaterThan(90e3);
  });
});

test("slots of a run join, and their speed changes slowly within limits", () => {
  const wander = fc.array(fc.double({ min: -140e3, max: 140e3, noNaN: true }), { minLength: 50, maxLength: 200 });
  fc.assert(
    fc.property(wander, (offsets) => {
      const schedule = new Schedule();
      let previous = schedule.add(5, 1e9, false);
      offsets.forEach((offset, index) => {
        const slot = schedule.add(6 + index, 1e9 + (index + 1) * SLOT_US + offset, false);
        expect(Math.abs(slot.speed - 1)).toBeLessThanOrEqual(0.005 + 1e-12);
        if (slot.run === previous.run) {
          expect(slot.stageTime).toBe(stageTimeAtEnd(previous));
          expect(Math.abs(slot.speed - previous.speed)).toBeLessThanOrEqual(0.0005 + 1e-12);
        }
        expect(schedule.stageAt(slot.index * SLOT_FRAMES)).toEqual({ time: slot.stageTime, run: slot.run });
        expect(schedule.stageAt((slot.index + 0.5) * SLOT_FRAMES)!.time).toBeCloseTo(
          slot.stageTime + (slot.speed * SLOT_US) / 2,
          3,
        );
        previous = slot;
      });
    }),
  );
});

describe("a new run starts", () => {
  test("after silence, where a jump is inaudible", () => {
    const schedule = new Schedule();
    schedule.add(0, 0, true);
    expect(schedule.add(1, SLOT_US + 20e3, true)).toEqual({ index: 1, stageTime: SLOT_US + 20e3, speed: 1, run: 2 });
    expect(schedule.add(2, 2 * SLOT_US + 20e3 + 500, true).run).toBe(2);
  });

  test("if the error is too large, and after a missed slot", () => {
    const schedule = new Schedule();
    schedule.add(0, 0, false);
    expect(schedule.add(1, SLOT_US - 200e3, false)).toEqual({ index: 1, stageTime: SLOT_US - 200e3, speed: 1, run: 2 });
    expect(schedule.add(4, 3 * SLOT_US, false).run).toBe(3);
    expect(schedule.stageAt(2.5 * SLOT_FRAMES)).toBeNull();
    schedule.clear();
    expect([schedule.last, schedule.stageAt(0)]).toEqual([null, null]);
    expect(schedule.add(5, 0, false).run).toBe(4);
  });
});

test("past slots are removed", () => {
  const schedule = new Schedule();
  for (let index = 0; index < 6; index++) schedule.add(index, index * SLOT_US, false);
  schedule.dropBefore(4);
  expect([3, 4, 5, 6].map((index) => schedule.slot(index)?.index ?? null)).toEqual([null, 4, 5, null]);
});
