/** Work per frame, from traces. */
import { expect, test } from "vitest";
import { CALLBACK_EVENTS, findDrawnFrames, sumMainThreadWork, TASK_EVENTS, type TraceEvent } from "./page/frame-trace";

const [MAIN, WORKER] = [1, 2];

/** Return an event of a thread. Times are in milliseconds; half of the duration is processor time. */
function event(tid: number, name: string, startMs: number, durationMs?: number): TraceEvent {
  const times = durationMs === undefined ? {} : { dur: 1000 * durationMs, tdur: 500 * durationMs };
  return { name, pid: 1, tid, ts: 1000 * startMs, ...times };
}

test("main-thread work counts events from a frame to the next", () => {
  const events = [
    event(MAIN, "RunTask", 2, 2),
    event(MAIN, "RunTask", 9, 4),
    event(MAIN, "frame", 10),
    event(WORKER, "RunTask", 12, 20),
    event(MAIN, "RunTask", 14, 2),
    event(MAIN, "HandlePostMessage", 14, 2),
    event(MAIN, "RunTask", 25, 4),
    event(MAIN, "frame", 26),
    event(MAIN, "RunTask", 41, 4),
    event(MAIN, "frame", 42),
  ];
  // The last frame is not followed by another.
  expect(sumMainThreadWork(events, TASK_EVENTS)).toEqual([3, 2]);
  expect(sumMainThreadWork(events, CALLBACK_EVENTS)).toEqual([1, 0]);
});

test("only callbacks of the engine's thread that drew are counted", () => {
  const events = [
    event(MAIN, "FireAnimationFrame", 0, 30),
    event(WORKER, "FireAnimationFrame", 0, 8),
    event(WORKER, "drawn", 7),
    event(WORKER, "FireAnimationFrame", 16, 2),
  ];
  expect(findDrawnFrames(events)).toEqual({ callbackCount: 2, work: [4], wall: [8] });
});
