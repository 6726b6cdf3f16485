/**
 * How much later than the reference clock a viewer shows the stage, so that what is pulled has come when it is due (adaptive
 * play-out: Ramjee, Kurose, Towsley and Schulzrinne, Infocom 1994). Nearly all of the last messages would have come in time; on
 * a quick line the delay is none. It is slewed and never steps: up at 5 % of the time that passes, down over some ten seconds.
 * As `playout/delay.py`. All arguments and results are microseconds.
 */

/** Of the last messages, this part is to come in time. */
const SHARE = 0.95;
/** Beyond that. */
const MARGIN = 10e3;
/** No stage is shown later. */
export const GREATEST = 400e3;
/** Messages that are remembered: four seconds, at thirty a second. */
const KEPT = 128;
/** Nothing is said by fewer: the first one may be an old one, sent to who joins. */
const LEAST = 20;
/** Microseconds a microsecond. */
export const SLEW = 0.05;
/** Time constant on the way down. */
const SHRINKING = 10e6;

export class PlayoutDelay {
  private readonly late: number[] = [];
  private next = 0;
  // the delay in use was `from` at local time `since`, and goes to `goal`
  private from = 0;
  private since = 0;
  private goal = 0;

  /** At local time `local` a message came `late` after it was first needed, below zero before. With none it stays as it is. */
  heard(late: number, local: number): void {
    this.late[this.next] = late;
    this.next = (this.next + 1) % KEPT;
    if (this.late.length < LEAST) return;
    const sorted = Float64Array.from(this.late).sort();
    const enough = sorted[Math.ceil(SHARE * sorted.length) - 1] + MARGIN;
    this.from = this.at(local);
    this.since = Math.max(local, this.since);
    this.goal = Math.min(Math.max(enough, 0), GREATEST);
  }

  /** The delay in use at local time `local`: on its way to what is enough. */
  at(local: number): number {
    const passed = Math.max(local - this.since, 0), away = this.goal - this.from;
    if (away >= 0) return Math.min(this.from + SLEW * passed, this.goal);
    // no more than the greatest delay over the time constant: within the slew
    return this.goal + -away * Math.exp(-passed / SHRINKING);
  }
}
