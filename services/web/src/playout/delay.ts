/**
 * Play-out delay of a viewer behind the reference clock, so that overlays arrive before they are due.
 *
 * Adaptive play-out (Ramjee, Kurose, Towsley and Schulzrinne, Infocom 1994): nearly all of the last messages would have
 * arrived in time; on a fast link the delay is zero. It slews and never steps: up by 5 % of the elapsed time, down over
 * some ten seconds. All arguments and results are microseconds. Counterpart of `playout/delay.py`.
 */

/** Share of the last messages that must arrive in time. */
const ON_TIME_QUANTILE = 0.95;
/** Added to that quantile. */
const DELAY_MARGIN_US = 10e3;
/** Upper bound of the delay. */
export const MAX_DELAY_US = 400e3;
/** Messages in the quantile: four seconds at 30 per second. */
const LATENESS_SAMPLES = 128;
/** Minimum number of messages: the first may be an old one, sent to a viewer that joins. */
const MIN_LATENESS_SAMPLES = 20;
/** Upper bound of the growth of the delay, microseconds per microsecond. */
export const MAX_GROWTH_RATE = 0.05;
/** Time constant of its decrease. */
const SHRINK_TIME_CONSTANT_US = 10e6;

/** Play-out delay of one viewer. */
export class PlayoutDelay {
  private readonly lateness: number[] = [];
  private next = 0;
  // the delay in use was `start` at local time `startedAt`, and approaches `target`
  private start = 0;
  private startedAt = 0;
  private target = 0;

  /**
   * Add a message that arrived at local time `local`, `lateness` after it was needed (negative if before). Without
   * messages the delay does not change.
   */
  addLateness(lateness: number, local: number): void {
    this.lateness[this.next] = lateness;
    this.next = (this.next + 1) % LATENESS_SAMPLES;
    if (this.lateness.length < MIN_LATENESS_SAMPLES) return;
    const sorted = Float64Array.from(this.lateness).sort();
    const required = sorted[Math.ceil(ON_TIME_QUANTILE * sorted.length) - 1] + DELAY_MARGIN_US;
    this.start = this.at(local);
    this.startedAt = Math.max(local, this.startedAt);
    this.target = Math.min(Math.max(required, 0), MAX_DELAY_US);
  }

  /** Return the delay in use at local time `local`. */
  at(local: number): number {
    const elapsed = Math.max(local - this.startedAt, 0),
      difference = this.target - this.start;
    if (difference >= 0) return Math.min(this.start + MAX_GROWTH_RATE * elapsed, this.target);
    // the rate of decrease is at most MAX_DELAY_US / SHRINK_TIME_CONSTANT_US
    return this.target - difference * Math.exp(-elapsed / SHRINK_TIME_CONSTANT_US);
  }
}
