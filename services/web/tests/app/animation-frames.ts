/** Animation frames that tests run by hand. */
import { vi } from "vitest";

export interface AnimationFrames {
  /** Number of callbacks that wait for the next frame. */
  readonly pending: number;
  /** Run the callbacks of one frame. */
  run(): void;
}

/** Replace `requestAnimationFrame` until `vi.unstubAllGlobals`. */
export function stubAnimationFrames(): AnimationFrames {
  let callbacks: (() => void)[] = [];
  vi.stubGlobal("requestAnimationFrame", (callback: () => void) => callbacks.push(callback));
  return {
    get pending() {
      return callbacks.length;
    },
    run() {
      const due = callbacks;
      callbacks = [];
      for (const callback of due) callback();
    },
  };
}
