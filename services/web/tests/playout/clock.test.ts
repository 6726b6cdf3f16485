import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import { ReferenceClock } from "../../src/playout/clock";

const UNIX = 1_774_000_000_000_000;

/** A round trip started at local `sent`: `out` and `back` microseconds on the way, the server being `ahead`. */
function exchangePing(clock: ReferenceClock, sent: number, out: number, back: number, ahead: number): number {
  const received = sent + out + ahead;
  clock.addSample(sent, received, received + 50, sent + out + 50 + back);
  return sent + out + 50 + back;
}

test("before anything came it is not ready", () => {
  const clock = new ReferenceClock();
  expect(clock.hasEstimate).toBe(false);
  expect(clock.errorBound).toBe(Infinity);
});

test("the greeting says the time, late by its way, until an answer says it better", () => {
  const clock = new ReferenceClock();
  clock.setEstimate(UNIX, 75_000);
  expect(clock.at(75_000)).toBe(UNIX);
  exchangePing(clock, 80_000, 75_000, 75_000, UNIX);
  expect(clock.offset).toBe(UNIX);
  clock.setEstimate(UNIX - 5_000_000, 300_000);
  expect(clock.offset).toBe(UNIX);
});

test("an even line gives the offset exactly, and half the trip as the error", () => {
  const clock = new ReferenceClock();
  const now = exchangePing(clock, 1_000, 30_000, 30_000, UNIX);
  expect(clock.at(now)).toBe(now + UNIX);
  expect(clock.errorBound).toBe(30_000);
});

test("what waited least each way counts, and grows old by what clocks may drift", () => {
  const clock = new ReferenceClock();
  exchangePing(clock, 0, 10_000, 200_000, UNIX);
  exchangePing(clock, 1e6, 200_000, 10_000, UNIX);
  for (let i = 2; i < 8; i++) exchangePing(clock, i * 1e6, 200_000, 40_000, UNIX);
  expect(Math.abs(clock.offset - UNIX)).toBeLessThan(200);
  expect(clock.errorBound).toBeLessThan(12_000);
  // worse both ways, but 200 s newer
  exchangePing(clock, 210e6, 60_000, 20_000, UNIX);
  expect(clock.offset).toBeCloseTo(UNIX + (52_000 - 20_000) / 2, -4);
  expect(clock.errorBound).toBeGreaterThan(30_000);
});

test("a clock that was set anew is believed", () => {
  const clock = new ReferenceClock();
  for (let i = 0; i < 4; i++) exchangePing(clock, i * 1e6, 20_000, 30_000, UNIX);
  exchangePing(clock, 5e6, 30_000, 30_000, UNIX + 500_000);
  expect([clock.offset, clock.errorBound]).toEqual([UNIX + 500_000, 30_000]);
});

test("answers that took less than no time are ignored", () => {
  const clock = new ReferenceClock();
  clock.addSample(1000, UNIX, UNIX + 500, 1400);
  clock.addSample(1000, UNIX, UNIX - 1, 1400);
  expect(clock.hasEstimate).toBe(false);
});

test("a new connection forgets the answers and keeps the time", () => {
  const clock = new ReferenceClock();
  const now = exchangePing(clock, 0, 1_000, 1_000, UNIX);
  clock.restart();
  expect(clock.errorBound).toBe(Infinity);
  expect(clock.at(now)).toBe(now + UNIX);
  clock.setEstimate(now + UNIX + 40_000, now);
  expect(clock.at(now)).toBe(now + UNIX);
});

describe("the slew", () => {
  const error = fc.integer({ min: -30_000_000, max: 30_000_000 });

  test("never steps and never runs backwards", () => {
    fc.assert(
      fc.property(
        fc.array(fc.tuple(error, fc.integer({ min: 16_000, max: 3_000_000 })), { maxLength: 6 }),
        (changes) => {
          const clock = new ReferenceClock();
          exchangePing(clock, 0, 1_000, 1_000, 0);
          let now = 10_000;
          let shown = clock.at(now);
          for (const [ahead, wait] of changes) {
            clock.restart();
            const step = clock.slewedOffset(now);
            clock.addSample(now, now + ahead, now + ahead, now);
            expect(Math.abs(clock.slewedOffset(now) - step)).toBeLessThan(1e-3);
            for (let passed = 0; passed < wait; passed += 8_000) {
              now += 8_000;
              expect(clock.at(now)).toBeGreaterThan(shown);
              shown = clock.at(now);
            }
          }
        },
      ),
    );
  });

  test("closes on the offset", () => {
    fc.assert(
      fc.property(error, (ahead) => {
        const clock = new ReferenceClock();
        exchangePing(clock, 0, 0, 0, 0);
        clock.restart();
        clock.addSample(100, 100 + ahead, 100 + ahead, 100);
        expect(Math.abs(clock.slewedOffset(60e6) - ahead)).toBeLessThan(1);
      }),
    );
  });
});
