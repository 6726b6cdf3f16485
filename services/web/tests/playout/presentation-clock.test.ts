import { expect, test } from "vitest";
import { PresentationClock } from "../../src/playout/presentation-clock";

const FRAME = 16_667;

/** Return the time of frame `nth`. */
const at = (nth: number) => nth * FRAME;

test("own time is presented without a leader", () => {
  const clock = new PresentationClock();
  for (const own of [5e6, 5e6 + FRAME, 9e6]) expect(clock.at(own, null, own - 3e6)).toBe(own);
});

test("leader is approached without a step, then followed exactly", () => {
  const clock = new PresentationClock();
  const ahead = 40_000;
  let presented = clock.at(at(0), null, at(0));
  for (let nth = 1; nth < 200; nth++) {
    const next = clock.at(at(nth), { time: at(nth) + ahead, run: 1 }, at(nth));
    expect(next - presented).toBeGreaterThan(0);
    expect(next - presented).toBeLessThan(1.5 * FRAME);
    presented = next;
  }
  expect(presented).toBeCloseTo(at(199) + ahead, -1);
  // within a run any speed of the leader is followed
  expect(clock.at(at(200), { time: 12_345_678, run: 1 }, at(200))).toBeCloseTo(12_345_678, -1);
});

test("jump or end of the leader is slewed", () => {
  const clock = new PresentationClock();
  clock.at(at(0), { time: at(0), run: 1 }, at(0));
  expect(clock.at(at(1), { time: at(1) - 90_000, run: 2 }, at(1))).toBeCloseTo(at(1), 3);
  expect(clock.at(at(400), { time: at(400) - 90_000, run: 2 }, at(400))).toBeCloseTo(at(400) - 90_000, -1);
  expect(clock.at(at(401), null, at(401))).toBeCloseTo(at(401) - 90_000, -1);
  expect(clock.at(at(900), null, at(900))).toBeCloseTo(at(900), -1);
});

test("queries may be out of order, and a distant leader is followed at once", () => {
  const clock = new PresentationClock();
  clock.at(at(0), null, at(0));
  clock.at(at(1), { time: at(1) + 30_000, run: 1 }, at(1));
  const now = clock.at(at(10), { time: at(10) + 30_000, run: 1 }, at(10));
  clock.at(at(2), { time: at(2) + 30_000, run: 1 }, at(2));
  expect(clock.at(at(10), { time: at(10) + 30_000, run: 1 }, at(10))).toBe(now);
  expect(clock.at(at(11), { time: 9e9, run: 2 }, at(11))).toBe(9e9);
});
