/**
 * The reference clock as seen from this end of a line.
 *
 * Pings and pongs are of equal size, so on a narrow line both ways take equally long to send. Each answer says between which
 * bounds the offset lies: it is off by half its round trip at most, and by what the clocks have drifted since. The offset is the
 * middle of what the last samples leave (Marzullo and Owicki 1983): one that waited least on its way there and another that
 * waited least on its way back say it together. The offset in use slews towards it and never steps.
 */

import { Slew } from "./slew";

const SAMPLES = 32;

/** So many answers, and the best of them is a good one. */
const SETTLED = 8;

/** Microseconds a microsecond that two clocks may go apart. */
const DRIFT = 200e-6;

/** Further off than any greeting is late, microseconds. */
const ANOTHER = 2e6;

interface Sample {
  offset: number;
  trip: number;
  at: number;
}

/** Local time to reference time; all arguments and results are microseconds. */
export class ReferenceClock {
  private readonly samples: Sample[] = [];
  private bound = Infinity;
  private readonly slew = new Slew();
  private goal: number | null = null;

  /** Whether anything has told the time yet. */
  get ready(): boolean {
    return this.goal !== null;
  }

  /** Whether so many answers came that the offset will not change by much any more. */
  get settled(): boolean {
    return this.samples.length >= SETTLED;
  }

  /** Reference minus local, as far as the samples say; until there is one, by the greeting. */
  get offset(): number {
    return this.goal ?? 0;
  }

  /** How far the offset may be off at most, when the last answer came. Infinite before the first. */
  get error(): number {
    return this.bound;
  }

  /**
   * The server's greeting said it was `now` and came at local time `arrived`. It is late by its way here, which is good enough
   * to start by; after a new connection it counts only where it tells of quite another clock.
   */
  greeting(now: number, arrived: number): void {
    const offset = now - arrived;
    const another = this.goal === null || Math.abs(offset - this.goal) > ANOTHER;
    if (this.samples.length === 0 && another) this.aim(offset, arrived);
  }

  /**
   * Takes in an answer: `sent` and `arrived` on the local clock, `received` and `answered` on the reference clock. One that
   * took less than no time is ignored.
   */
  pong(sent: number, received: number, answered: number, arrived: number): void {
    const trip = arrived - sent - (answered - received);
    if (trip < 0 || answered < received) return;
    this.samples.push({ offset: (received - sent + (answered - arrived)) / 2, trip, at: arrived });
    if (this.samples.length > SAMPLES) this.samples.shift();
    const off = (sample: Sample) => sample.trip / 2 + DRIFT * (arrived - sample.at);
    for (;;) {
      const low = Math.max(...this.samples.map((sample) => sample.offset - off(sample)));
      const high = Math.min(...this.samples.map((sample) => sample.offset + off(sample)));
      if (low <= high || this.samples.length === 1) {
        this.bound = (high - low) / 2;
        this.aim(low + (high - low) / 2, arrived);
        return;
      }
      // a clock was set anew: what was said before is no longer true
      this.samples.shift();
    }
  }

  /** A new connection, perhaps to another machine: older answers say nothing about it. The offset in use stays. */
  restart(): void {
    this.samples.length = 0;
    this.bound = Infinity;
  }

  /** The offset in use at `local`: on its way to `offset`. */
  shownOffset(local: number): number {
    return this.goal === null ? 0 : this.slew.at(local);
  }

  /** The reference time at `local`. */
  at(local: number): number {
    return local + this.shownOffset(local);
  }

  private aim(goal: number, local: number): void {
    if (this.goal === null) this.slew.start(goal, goal, local);
    else this.slew.aim(goal, local);
    this.goal = goal;
  }
}
