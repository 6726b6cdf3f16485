/** Long work done beside a page that stays alive: a few milliseconds at a time, until it is done or given up. */
import type { IncrementalTask } from "./sampled-motion";

/** Milliseconds of work between two breaths: less than a frame. */
const SLICE_MS = 8;

export interface SliceOptions {
  /** Told of the share done, 0..1, at each breath. */
  onProgress?: (share: number) => void;
  signal?: AbortSignal;
  /** The time in milliseconds, and what lets others go first. */
  now?: () => number;
  yieldToEventLoop?: () => Promise<unknown>;
}

/** What `work` makes. Given up by `signal`, it rejects with the signal's reason. */
export async function runInSlices<T>(
  work: IncrementalTask<T>,
  { onProgress: told, signal, now = () => performance.now(), yieldToEventLoop: breathe = nextTask }: SliceOptions = {},
): Promise<T> {
  let until = now() + SLICE_MS;
  for (;;) {
    signal?.throwIfAborted();
    const { done, value } = work.next();
    if (done) return value;
    if (now() < until) continue;
    told?.(value);
    await breathe();
    until = now() + SLICE_MS;
  }
}

function nextTask(): Promise<unknown> {
  return new Promise((resolve) => setTimeout(resolve));
}
