import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import { ReferenceClock } from "../../src/playout/clock";

const EPOCH_US = 1_774_000_000_000_000;

/** Simulate a round trip from local time `sent`, with delays `out` and `back`; the server's clock is `ahead`. */
function exchangePing(clock: ReferenceClock, sent: number, out: number, back: number, ahead: number): number {
  const received = sent + out + ahead;
  clock.addSample(sent, received, received + 50, sent + out + 50 + back);
  return sent + out + 50 + back;
}

test("there is no estimate before the first message", () => {
  const clock = new ReferenceClock();
  expect(clock.hasEstimate).toBe(false);
  expect(clock.errorBound).toBe(Infinity);
});

test("Channel Header sets the estimate until the first sample", () => {
  const clock = new ReferenceClock();
  clock.setEstimate(EPOCH_US, 75_000);
  expect(clock.at(75_000)).toBe(EPOCH_US);
  exchangePing(clock, 80_000, 75_000, 75_000, EPOCH_US);
  expect(clock.offset).toBe(EPOCH_US);
  clock.setEstimate(EPOCH_US - 5_000_000, 300_000);
  expect(clock.offset).toBe(EPOCH_US);
});

test("symmetric delays give the exact offset and half the trip as error", () => {
  const clock = new ReferenceClock();
  const now = exchangePing(clock, 1_000, 30_000, 30_000, EPOCH_US);
  expect(clock.at(now)).toBe(now + EPOCH_US);
  expect(clock.errorBound).toBe(30_000);
});

test("fastest delay of each direction counts, and ages with the drift", () => {
  const clock = new ReferenceClock();
  exchangePing(clock, 0, 10_000, 200_000, EPOCH_US);
  exchangePing(clock, 1e6, 200_000, 10_000, EPOCH_US);
  for (let i = 2; i < 8; i++) exchangePing(clock, i * 1e6, 200_000, 40_000, EPOCH_US);
  expect(Math.abs(clock.offset - EPOCH_US)).toBeLessThan(200);
  expect(clock.errorBound).toBeLessThan(12_000);
  // slower both ways, but 200 s newer
  exchangePing(clock, 210e6, 60_000, 20_000, EPOCH_US);
  expect(clock.offset).toBeCloseTo(EPOCH_US + (52_000 - 20_000) / 2, -4);
  expect(clock.errorBound).toBeGreaterThan(30_000);
});

test("stepped clock replaces older samples", () => {
  const clock = new ReferenceClock();
  for (let i = 0; i < 4; i++) exchangePing(clock, i * 1e6, 20_000, 30_000, EPOCH_US);
  exchangePing(clock, 5e6, 30_000, 30_000, EPOCH_US + 500_000);
  expect([clock.offset, clock.errorBound]).toEqual([EPOCH_US + 500_000, 30_000]);
});

test("negative round trips are ignored", () => {
  const clock = new ReferenceClock();
  clock.addSample(1000, EPOCH_US, EPOCH_US + 500, 1400);
  clock.addSample(1000, EPOCH_US, EPOCH_US - 1, 1400);
  expect(clock.hasEstimate).toBe(false);
});

test("restart drops the samples and keeps the offset", () => {
  const clock = new ReferenceClock();
  const now = exchangePing(clock, 0, 1_000, 1_000, EPOCH_US);
  clock.restart();
  expect(clock.errorBound).toBe(Infinity);
  expect(clock.at(now)).toBe(now + EPOCH_US);
  clock.setEstimate(now + EPOCH_US + 40_000, now);
  expect(clock.at(now)).toBe(now + EPOCH_US);
});

describe("slew", () => {
  const error = fc.integer({ min: -30_000_000, max: 30_000_000 });

  test("never steps and never runs backwards", () => {
    fc.assert(
      fc.property(
        fc.array(fc.tuple(error, fc.integer({ min: 16_000, max: 3_000_000 })), { maxLength: 6 }),
        (changes) => {
          const clock = new ReferenceClock();
          exchangePing(clock, 0, 1_000, 1_000, 0);
          let now = 10_000;
          let presented = clock.at(now);
          for (const [ahead, wait] of changes) {
            clock.restart();
            const step = clock.slewedOffset(now);
            clock.addSample(now, now + ahead, now + ahead, now);
            expect(Math.abs(clock.slewedOffset(now) - step)).toBeLessThan(1e-3);
            for (let passed = 0; passed < wait; passed += 8_000) {
              now += 8_000;
              expect(clock.at(now)).toBeGreaterThan(presented);
              presented = clock.at(now);
            }
          }
        },
      ),
    );
  });

  test("approaches the offset", () => {
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
