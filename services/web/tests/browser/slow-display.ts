/** Display with a low refresh rate. Software rendering at the full rate would take all processors. */
import type { Page } from "playwright-core";
import { installInRealms } from "./engine-probe";

/** Interval between frames, in milliseconds. Pages stay well below the time after which they lose their limbs. */
const SLOW_FRAME_INTERVAL_MS = 100;

/** Limit the frame rate of a page, before it navigates, and of its workers. */
export function limitFrameRate(page: Page): Promise<void> {
  return installInRealms(page, slowDownDisplay, SLOW_FRAME_INTERVAL_MS);
}

/**
 * In a page before its scripts, or in a worker: leave `intervalMs` between the frames that run animation callbacks. The
 * browser still runs each callback, so timestamps and errors are its own.
 */
export function slowDownDisplay(intervalMs: number): void {
  const request = globalThis.requestAnimationFrame.bind(globalThis);
  const cancel = globalThis.cancelAnimationFrame.bind(globalThis);
  const startTimer = globalThis.setTimeout.bind(globalThis);
  const queued = new Map<number, FrameRequestCallback>();
  /** The browser's handles, by those of the page. */
  const requested = new Map<number, number>();
  let lastHandle = 0;
  let lastFrameMs = Number.NEGATIVE_INFINITY;
  let isTimerRunning = false;

  function requestFrame(): void {
    isTimerRunning = false;
    for (const [handle, callback] of queued)
      requested.set(
        handle,
        request((now) => {
          lastFrameMs = now;
          requested.delete(handle);
          callback(now);
        }),
      );
    queued.clear();
  }

  globalThis.requestAnimationFrame = (callback) => {
    queued.set(++lastHandle, callback);
    if (!isTimerRunning) startTimer(requestFrame, Math.max(0, lastFrameMs + intervalMs - performance.now()));
    isTimerRunning = true;
    return lastHandle;
  };
  globalThis.cancelAnimationFrame = (handle) => {
    queued.delete(handle);
    const native = requested.get(handle);
    if (native !== undefined) cancel(native);
    requested.delete(handle);
  };
}
