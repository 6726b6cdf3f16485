import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import { Schedule, SLOT_FRAMES, SLOT_US, stageTimeAtEnd } from "../../src/audio/schedule";

/** Slots that are scheduled before they are heard. */
const AHEAD = 24;

/** Minutes of slots against an own clock that runs `drift` faster than the device and is `wobble(t)` off; the errors when heard. */
function errors(
  schedule: Schedule,
  minutes: number,
  drift: number,
  wobble: (us: number) => number,
  silent = false,
): number[] {
  const own = (us: number) => 7e9 + us * (1 + drift);
  const found: number[] = [];
  for (let index = 0; index < minutes * 60 * 16; index++) {
    const heard = index * SLOT_US;
    const told = own(heard) + wobble(heard - AHEAD * SLOT_US);
    schedule.add(index, told, silent);
    found.push(schedule.stageAt(index * SLOT_FRAMES)!.time - own(heard));
    schedule.dropBefore(index - 40);
  }
  return found;
}

describe("the sound stays with the viewer's own clock", () => {
  test("without drifting away, whatever the device's speed", () => {
    fc.assert(
      fc.property(fc.double({ min: -500e-6, max: 500e-6, noNaN: true }), (drift) => {
        const found = errors(new Schedule(), 3, drift, () => 0);
        expect(Math.max(...found.map(Math.abs))).toBeLessThan(8e3);
        const late = found.slice(-160);
        expect(Math.max(...late) - Math.min(...late)).toBeLessThan(100);
      }),
      { numRuns: 20 },
    );
  });

  test("and does not follow every turn of it", () => {
    const schedule = new Schedule();
    const found = errors(schedule, 2, 0, (us) => 30e3 * Math.sin(us / 0.4e6));
    expect(Math.max(...found.slice(160).map(Math.abs))).toBeLessThan(36e3);
    expect(schedule.last?.run).toBe(1);
  });

  test("a clock that is 100 ms off is caught up with in half a minute, unheard", () => {
    const schedule = new Schedule();
    const found = errors(schedule, 1, 0, (us) => (us > 1e6 ? 100e3 : 0));
    expect(schedule.last?.run).toBe(1);
    expect(found.at(-1)).toBeGreaterThan(97e3);
    expect(found[16 * 32]).toBeGreaterThan(90e3);
  });
});

test("slots of a run follow each other, at speeds that change gently and by half a percent at most", () => {
  const wander = fc.array(fc.double({ min: -140e3, max: 140e3, noNaN: true }), { minLength: 50, maxLength: 200 });
  fc.assert(
    fc.property(wander, (offs) => {
      const schedule = new Schedule();
      let before = schedule.add(5, 1e9, false);
      offs.forEach((off, nth) => {
        const slot = schedule.add(6 + nth, 1e9 + (nth + 1) * SLOT_US + off, false);
        expect(Math.abs(slot.speed - 1)).toBeLessThanOrEqual(0.005 + 1e-12);
        if (slot.run === before.run) {
          expect(slot.stageTime).toBe(stageTimeAtEnd(before));
          expect(Math.abs(slot.speed - before.speed)).toBeLessThanOrEqual(0.0005 + 1e-12);
        }
        expect(schedule.stageAt(slot.index * SLOT_FRAMES)).toEqual({ time: slot.stageTime, run: slot.run });
        expect(schedule.stageAt((slot.index + 0.5) * SLOT_FRAMES)!.time).toBeCloseTo(
          slot.stageTime + (slot.speed * SLOT_US) / 2,
          3,
        );
        before = slot;
      });
    }),
  );
});

describe("a new run begins", () => {
  test("where nothing is heard of the jump", () => {
    const schedule = new Schedule();
    schedule.add(0, 0, true);
    expect(schedule.add(1, SLOT_US + 20e3, true)).toEqual({ index: 1, stage: SLOT_US + 20e3, speed: 1, run: 2 });
    expect(schedule.add(2, 2 * SLOT_US + 20e3 + 500, true).run).toBe(2);
  });

  test("where the sound is too far off, and where a slot was missed", () => {
    const schedule = new Schedule();
    schedule.add(0, 0, false);
    expect(schedule.add(1, SLOT_US - 200e3, false)).toEqual({ index: 1, stage: SLOT_US - 200e3, speed: 1, run: 2 });
    expect(schedule.add(4, 3 * SLOT_US, false).run).toBe(3);
    expect(schedule.stageAt(2.5 * SLOT_FRAMES)).toBeNull();
    schedule.clear();
    expect([schedule.last, schedule.stageAt(0)]).toEqual([null, null]);
    expect(schedule.add(5, 0, false).run).toBe(4);
  });
});

test("what was heard is forgotten when told", () => {
  const schedule = new Schedule();
  for (let index = 0; index < 6; index++) schedule.add(index, index * SLOT_US, false);
  schedule.dropBefore(4);
  expect([3, 4, 5, 6].map((index) => schedule.slot(index)?.index ?? null)).toEqual([null, 4, 5, null]);
});
