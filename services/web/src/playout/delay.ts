/**
 * How much later than the reference clock a viewer shows the stage, so that what is pulled has come when it is due (adaptive
 * play-out: Ramjee, Kurose, Towsley and Schulzrinne, Infocom 1994). Nearly all of the last messages would have come in time; on
 * a quick line the delay is none. It is slewed and never steps: up at 5 % of the time that passes, down over some ten seconds.
 * As `playout/delay.py`. All arguments and results are microseconds.
 */

/** Of the last messages, this part is to come in time. */
const ON_TIME_QUANTILE = 0.95;
/** Beyond that. */
const DELAY_MARGIN_US = 10e3;
/** No stage is shown later. */
export const MAX_DELAY_US = 400e3;
/** Messages that are remembered: four seconds, at thirty a second. */
const LATENESS_SAMPLES = 128;
/** Nothing is said by fewer: the first one may be an old one, sent to who joins. */
const MIN_LATENESS_SAMPLES = 20;
/** Microseconds a microsecond. */
export const MAX_GROWTH_RATE = 0.05;
/** Time constant on the way down. */
const SHRINK_TIME_CONSTANT_US = 10e6;

export class PlayoutDelay {
  private readonly lateness: number[] = [];
  private next = 0;
  // the delay in use was `from` at local time `since`, and goes to `goal`
  private start = 0;
  private startedAt = 0;
  private target = 0;

  /** At local time `local` a message came `late` after it was first needed, below zero before. With none it stays as it is. */
  addLateness(lateness: number, local: number): void {
    this.lateness[this.next] = lateness;
    this.next = (this.next + 1) % LATENESS_SAMPLES;
    if (this.lateness.length < MIN_LATENESS_SAMPLES) return;
    const sorted = Float64Array.from(this.lateness).sort();
    const enough = sorted[Math.ceil(ON_TIME_QUANTILE * sorted.length) - 1] + DELAY_MARGIN_US;
    this.start = this.at(local);
    this.startedAt = Math.max(local, this.startedAt);
    this.target = Math.min(Math.max(enough, 0), MAX_DELAY_US);
  }

  /** The delay in use at local time `local`: on its way to what is enough. */
  at(local: number): number {
    const passed = Math.max(local - this.startedAt, 0),
      away = this.target - this.start;
    if (away >= 0) return Math.min(this.start + MAX_GROWTH_RATE * passed, this.target);
    // no more than the greatest delay over the time constant: within the slew
    return this.target + -away * Math.exp(-passed / SHRINK_TIME_CONSTANT_US);
  }
}
