/** Runs long tasks in slices of a few milliseconds, so that the page stays responsive. */
import type { IncrementalTask } from "./sampled-motion";

/** Duration of a slice, in milliseconds: less than a frame. */
const SLICE_MS = 8;

export interface SliceOptions {
  /** Called with the share done, 0..1, after each slice. */
  onProgress?: (share: number) => void;
  signal?: AbortSignal;
  /** Clock in milliseconds, and a function that lets other tasks run. */
  now?: () => number;
  yieldToEventLoop?: () => Promise<unknown>;
}

/** Return the result of `work`. Reject with the signal's reason if aborted. */
export async function runInSlices<T>(
  work: IncrementalTask<T>,
  { onProgress, signal, now = () => performance.now(), yieldToEventLoop = nextTask }: SliceOptions = {},
): Promise<T> {
  let sliceEnd = now() + SLICE_MS;
  for (;;) {
    signal?.throwIfAborted();
    const { done, value } = work.next();
    if (done) return value;
    if (now() < sliceEnd) continue;
    onProgress?.(value);
    await yieldToEventLoop();
    sliceEnd = now() + SLICE_MS;
  }
}

function nextTask(): Promise<unknown> {
  return new Promise((resolve) => setTimeout(resolve));
}
