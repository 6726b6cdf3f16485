/** Age of a live performer's poses when they are due, over the last seconds. */

/** Time over which the median is taken, milliseconds. */
export const LATENCY_WINDOW_MS = 3_000;

/** Ages of the poses of one performer. */
export class LiveLatency {
  /** Ages and times of arrival, milliseconds, oldest first. */
  private readonly samples: { readonly ageMs: number; readonly atMs: number }[] = [];

  /** Add the age of poses that arrived at local `nowMs`. */
  add(ageUs: number, nowMs: number): void {
    this.samples.push({ ageMs: ageUs / 1000, atMs: nowMs });
    while (nowMs - this.samples[0].atMs > LATENCY_WINDOW_MS) this.samples.shift();
  }

  /** Return the median age, milliseconds, or null if no poses arrived lately. */
  ageMs(nowMs: number): number | null {
    const recent = this.samples.filter(({ atMs }) => nowMs - atMs <= LATENCY_WINDOW_MS);
    const ages = recent.map(({ ageMs }) => ageMs).sort((a, b) => a - b);
    return ages[ages.length >> 1] ?? null;
  }
}
