/** Long work done beside a page that stays alive: a few milliseconds at a time, until it is done or given up. */
import type { Work } from "./dance";

/** Milliseconds of work between two breaths: less than a frame. */
const SLICE = 8;

export interface Ease {
  /** Told of the share done, 0..1, at each breath. */
  told?: (share: number) => void;
  signal?: AbortSignal;
  /** The time in milliseconds, and what lets others go first. */
  now?: () => number;
  breathe?: () => Promise<unknown>;
}

/** What `work` makes. Given up by `signal`, it rejects with the signal's reason. */
export async function atEase<T>(work: Work<T>, { told, signal, now = () => performance.now(), breathe = nextTask }: Ease = {}): Promise<T> {
  let until = now() + SLICE;
  for (;;) {
    signal?.throwIfAborted();
    const { done, value } = work.next();
    if (done) return value;
    if (now() < until) continue;
    told?.(value);
    await breathe();
    until = now() + SLICE;
  }
}

function nextTask(): Promise<unknown> {
  return new Promise((resolve) => setTimeout(resolve));
}
