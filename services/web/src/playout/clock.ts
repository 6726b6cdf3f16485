/**
 * The reference clock as seen from this end of a line.
 *
 * Pings and pongs are of equal size, so on a narrow line both ways take equally long to send. Each answer says between which
 * bounds the offset lies: it is off by half its round trip at most, and by what the clocks have drifted since. The offset is the
 * middle of what the last samples leave (Marzullo and Owicki 1983): one that waited least on its way there and another that
 * waited least on its way back say it together. The offset in use slews towards it and never steps.
 */

import { Slew } from "./slew";

const MAX_SAMPLES = 32;

/** So many answers, and the best of them is a good one. */
const MIN_SETTLED_SAMPLES = 8;

/** Microseconds a microsecond that two clocks may go apart. */
const MAX_CLOCK_DRIFT = 200e-6;

/** Further off than any greeting is late, microseconds. */
const RESET_THRESHOLD_US = 2e6;

interface ClockSample {
  offset: number;
  roundTripUs: number;
  receivedAt: number;
}

/** Local time to reference time; all arguments and results are microseconds. */
export class ReferenceClock {
  private readonly samples: ClockSample[] = [];
  private currentErrorBound = Infinity;
  private readonly slew = new Slew();
  private target: number | null = null;

  /** Whether anything has told the time yet. */
  get hasEstimate(): boolean {
    return this.target !== null;
  }

  /** Whether so many answers came that the offset will not change by much any more. */
  get isSettled(): boolean {
    return this.samples.length >= MIN_SETTLED_SAMPLES;
  }

  /** Reference minus local, as far as the samples say; until there is one, by the greeting. */
  get offset(): number {
    return this.target ?? 0;
  }

  /** How far the offset may be off at most, when the last answer came. Infinite before the first. */
  get errorBound(): number {
    return this.currentErrorBound;
  }

  /**
   * The server's greeting said it was `now` and came at local time `arrived`. It is late by its way here, which is good enough
   * to start by; after a new connection it counts only where it tells of quite another clock.
   */
  setEstimate(now: number, arrived: number): void {
    const offset = now - arrived;
    const another = this.target === null || Math.abs(offset - this.target) > RESET_THRESHOLD_US;
    if (this.samples.length === 0 && another) this.slewTo(offset, arrived);
  }

  /**
   * Takes in an answer: `sent` and `arrived` on the local clock, `received` and `answered` on the reference clock. One that
   * took less than no time is ignored.
   */
  addSample(sent: number, received: number, answered: number, arrived: number): void {
    const trip = arrived - sent - (answered - received);
    if (trip < 0 || answered < received) return;
    this.samples.push({ offset: (received - sent + (answered - arrived)) / 2, roundTripUs: trip, receivedAt: arrived });
    if (this.samples.length > MAX_SAMPLES) this.samples.shift();
    const off = (sample: ClockSample) => sample.roundTripUs / 2 + MAX_CLOCK_DRIFT * (arrived - sample.receivedAt);
    for (;;) {
      const low = Math.max(...this.samples.map((sample) => sample.offset - off(sample)));
      const high = Math.min(...this.samples.map((sample) => sample.offset + off(sample)));
      if (low <= high || this.samples.length === 1) {
        this.currentErrorBound = (high - low) / 2;
        this.slewTo(low + (high - low) / 2, arrived);
        return;
      }
      // a clock was set anew: what was said before is no longer true
      this.samples.shift();
    }
  }

  /** A new connection, perhaps to another machine: older answers say nothing about it. The offset in use stays. */
  restart(): void {
    this.samples.length = 0;
    this.currentErrorBound = Infinity;
  }

  /** The offset in use at `local`: on its way to `offset`. */
  slewedOffset(local: number): number {
    return this.target === null ? 0 : this.slew.at(local);
  }

  /** The reference time at `local`. */
  at(local: number): number {
    return local + this.slewedOffset(local);
  }

  private slewTo(goal: number, local: number): void {
    if (this.target === null) this.slew.start(goal, goal, local);
    else this.slew.slewTo(goal, local);
    this.target = goal;
  }
}
