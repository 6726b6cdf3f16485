/** Age of live performers' poses when they are due, over the last seconds. */

/** Time over which the median is taken, milliseconds. */
export const LATENCY_WINDOW_MS = 3_000;

interface AgeSample {
  readonly ageMs: number;
  readonly atMs: number;
}

/** Ages of the live poses that a viewer received. */
export class LiveLatency {
  /** By performer, oldest first. */
  private readonly samples = new Map<number, AgeSample[]>();

  /** Add the age of poses that arrived at local `nowMs`. */
  add(performer: number, ageUs: number, nowMs: number): void {
    let samples = this.samples.get(performer);
    if (!samples) this.samples.set(performer, (samples = []));
    samples.push({ ageMs: ageUs / 1000, atMs: nowMs });
    while (nowMs - samples[0].atMs > LATENCY_WINDOW_MS) samples.shift();
  }

  /** Discard all ages, since the motion changed. */
  clear(): void {
    this.samples.clear();
  }

  /** Return the largest of the performers' median ages, milliseconds, or null if no poses arrived lately. */
  ageMs(nowMs: number): number | null {
    let largest: number | null = null;
    for (const samples of this.samples.values()) {
      const ages = samples.filter(({ atMs }) => nowMs - atMs <= LATENCY_WINDOW_MS).map(({ ageMs }) => ageMs);
      if (ages.length === 0) continue;
      const median = ages.sort((a, b) => a - b)[ages.length >> 1];
      largest = Math.max(largest ?? 0, median);
    }
    return largest;
  }
}
