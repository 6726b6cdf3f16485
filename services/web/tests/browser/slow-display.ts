/** Display with a low refresh rate. Software rendering at the full rate would take all processors. */

/** Interval between frames, in milliseconds. Pages stay well below the time after which they lose their limbs. */
export const SLOW_FRAME_INTERVAL_MS = 100;

/**
 * In the page, before its scripts: leave `intervalMs` between the frames that run animation callbacks. The browser still
 * runs each callback, so timestamps and errors are its own.
 */
export function slowDownDisplay(intervalMs: number): void {
  const request = window.requestAnimationFrame.bind(window);
  const cancel = window.cancelAnimationFrame.bind(window);
  const startTimer = window.setTimeout.bind(window);
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

  window.requestAnimationFrame = (callback) => {
    queued.set(++lastHandle, callback);
    if (!isTimerRunning) startTimer(requestFrame, Math.max(0, lastFrameMs + intervalMs - performance.now()));
    isTimerRunning = true;
    return lastHandle;
  };
  window.cancelAnimationFrame = (handle) => {
    queued.delete(handle);
    const native = requested.get(handle);
    if (native !== undefined) cancel(native);
    requested.delete(handle);
  };
}
