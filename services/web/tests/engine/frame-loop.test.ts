import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { FrameLoop } from "../../src/engine/frame-loop";

/** Interval of the display that the test pretends, in milliseconds. */
const DISPLAY_INTERVAL_MS = 16;

let isLate: boolean;
let drawn: number[];
let loop: FrameLoop;

beforeEach(() => {
  vi.useFakeTimers({ now: 0, toFake: ["performance", "setTimeout", "clearTimeout"] });
  vi.stubGlobal("requestAnimationFrame", (callback: () => void) =>
    setTimeout(callback, DISPLAY_INTERVAL_MS - (performance.now() % DISPLAY_INTERVAL_MS)),
  );
  vi.stubGlobal("cancelAnimationFrame", clearTimeout);
  [isLate, drawn] = [false, []];
  loop = new FrameLoop(
    () => drawn.push(Math.round(performance.now())),
    () => isLate,
  );
});
afterEach(() => {
  loop.stop();
  vi.unstubAllGlobals();
  vi.useRealTimers();
});

test("frames are drawn when the display asks for them", () => {
  vi.advanceTimersByTime(4 * DISPLAY_INTERVAL_MS);
  expect(drawn).toEqual([1, 2, 3, 4].map((frame) => frame * DISPLAY_INTERVAL_MS));
});

test("a late frame is drawn once, as soon as it can be, and the next with the display", () => {
  isLate = true;
  vi.advanceTimersByTime(DISPLAY_INTERVAL_MS + 5);
  expect(drawn).toEqual([DISPLAY_INTERVAL_MS]);
  isLate = false;
  vi.advanceTimersByTime(10);
  expect(drawn.slice(1)).toEqual([DISPLAY_INTERVAL_MS + 6]);
  vi.advanceTimersByTime(5);
  expect(drawn.slice(2)).toEqual([2 * DISPLAY_INTERVAL_MS]);
});

test("a graphics processor that is never ready is asked for the latest frame alone", () => {
  isLate = true;
  vi.advanceTimersByTime(10 * DISPLAY_INTERVAL_MS);
  expect(drawn).toHaveLength(10);
  expect(vi.getTimerCount()).toBe(2);
});

test("nothing is drawn after a stop", () => {
  isLate = true;
  vi.advanceTimersByTime(DISPLAY_INTERVAL_MS);
  loop.stop();
  isLate = false;
  vi.advanceTimersByTime(100);
  expect(drawn).toHaveLength(1);
  expect(vi.getTimerCount()).toBe(0);
});
