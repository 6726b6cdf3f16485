import { expect, test } from "vitest";
import { PresentationClock } from "../../src/playout/presentation-clock";

const FRAME = 16_667;

/** What is shown at frame `nth`. */
const at = (nth: number) => nth * FRAME;

test("without a leader one's own time is shown as it is", () => {
  const following = new PresentationClock();
  for (const own of [5e6, 5e6 + FRAME, 9e6]) expect(following.at(own, null, own - 3e6)).toBe(own);
});

test("a leader is gone over to without a step, and then followed as it is", () => {
  const following = new PresentationClock();
  const ahead = 40_000;
  let shown = following.at(at(0), null, at(0));
  for (let nth = 1; nth < 200; nth++) {
    const next = following.at(at(nth), { time: at(nth) + ahead, run: 1 }, at(nth));
    expect(next - shown).toBeGreaterThan(0);
    expect(next - shown).toBeLessThan(1.5 * FRAME);
    shown = next;
  }
  expect(shown).toBeCloseTo(at(199) + ahead, -1);
  // it may go at another speed, and is followed
  expect(following.at(at(200), { time: 12_345_678, run: 1 }, at(200))).toBeCloseTo(12_345_678, -1);
});

test("a leader that jumps, and one that goes, are slewed to", () => {
  const following = new PresentationClock();
  following.at(at(0), { time: at(0), run: 1 }, at(0));
  expect(following.at(at(1), { time: at(1) - 90_000, run: 2 }, at(1))).toBeCloseTo(at(1), 3);
  expect(following.at(at(400), { time: at(400) - 90_000, run: 2 }, at(400))).toBeCloseTo(at(400) - 90_000, -1);
  expect(following.at(at(401), null, at(401))).toBeCloseTo(at(401) - 90_000, -1);
  expect(following.at(at(900), null, at(900))).toBeCloseTo(at(900), -1);
});

test("asked for another instant it says what is shown then; a leader of quite another time is followed at once", () => {
  const following = new PresentationClock();
  following.at(at(0), null, at(0));
  following.at(at(1), { time: at(1) + 30_000, run: 1 }, at(1));
  const now = following.at(at(10), { time: at(10) + 30_000, run: 1 }, at(10));
  following.at(at(2), { time: at(2) + 30_000, run: 1 }, at(2));
  expect(following.at(at(10), { time: at(10) + 30_000, run: 1 }, at(10))).toBe(now);
  expect(following.at(at(11), { time: 9e9, run: 2 }, at(11))).toBe(9e9);
});
