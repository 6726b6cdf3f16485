/**
 * Reference clock as estimated at this end of a connection.
 *
 * Ping and Pong have the same size, so both directions take equally long on a constrained link. Each round trip bounds
 * the offset: it is wrong by at most half the round trip, plus the drift since then. The estimate is the middle of the
 * intersection of these bounds (Marzullo and Owicki 1983): a sample with a fast outward way and another with a fast
 * return complement each other. The offset in use slews towards the estimate and never steps.
 */

import { Slew } from "./slew";

const MAX_SAMPLES = 32;

/** Number of samples after which the estimate changes little. */
const MIN_SETTLED_SAMPLES = 8;

/** Upper bound of the drift between two clocks, microseconds per microsecond. */
const MAX_CLOCK_DRIFT = 200e-6;

/** A Channel Header that differs by more than its delay can explain replaces the estimate, microseconds. */
const RESET_THRESHOLD_US = 2e6;

/** Measurement of one round trip; microseconds. */
interface ClockSample {
  /** Reference time minus local time. */
  offset: number;
  roundTripUs: number;
  /** Local time at which the answer was received. */
  receivedAt: number;
}

/** Conversion of local time to reference time. All arguments and results are microseconds. */
export class ReferenceClock {
  private readonly samples: ClockSample[] = [];
  private currentErrorBound = Infinity;
  private readonly slew = new Slew();
  private target: number | null = null;

  /** True once the server has sent its time. */
  get hasEstimate(): boolean {
    return this.target !== null;
  }

  /** True once there are enough samples that the estimate will change little. */
  get isSettled(): boolean {
    return this.samples.length >= MIN_SETTLED_SAMPLES;
  }

  /** Estimate of reference time minus local time; from the Channel Header until the first sample. */
  get offset(): number {
    return this.target ?? 0;
  }

  /** Maximum error of the offset at the time of the last sample; infinite before the first. */
  get errorBound(): number {
    return this.currentErrorBound;
  }

  /**
   * Set the estimate from a Channel Header with reference time `reference`, received at `local`. It is wrong by the
   * delay of the message, and used until the first sample; after a reconnect, only if it differs by seconds.
   */
  setEstimate(reference: number, local: number): void {
    const offset = reference - local;
    const differs = this.target === null || Math.abs(offset - this.target) > RESET_THRESHOLD_US;
    if (this.samples.length === 0 && differs) this.slewTo(offset, local);
  }

  /**
   * Add a Pong: `sent` and `arrived` are local times, `received` and `answered` reference times. An answer with a
   * negative round trip is ignored.
   */
  addSample(sent: number, received: number, answered: number, arrived: number): void {
    const trip = arrived - sent - (answered - received);
    if (trip < 0 || answered < received) return;
    this.samples.push({ offset: (received - sent + (answered - arrived)) / 2, roundTripUs: trip, receivedAt: arrived });
    if (this.samples.length > MAX_SAMPLES) this.samples.shift();
    const error = (sample: ClockSample) => sample.roundTripUs / 2 + MAX_CLOCK_DRIFT * (arrived - sample.receivedAt);
    for (;;) {
      const low = Math.max(...this.samples.map((sample) => sample.offset - error(sample)));
      const high = Math.min(...this.samples.map((sample) => sample.offset + error(sample)));
      if (low <= high || this.samples.length === 1) {
        this.currentErrorBound = (high - low) / 2;
        this.slewTo(low + (high - low) / 2, arrived);
        return;
      }
      // the bounds contradict each other: a clock was stepped, and older samples are invalid
      this.samples.shift();
    }
  }

  /** Discard the samples after a reconnect, perhaps to another machine; the offset in use stays. */
  restart(): void {
    this.samples.length = 0;
    this.currentErrorBound = Infinity;
  }

  /** Return the offset in use at `local`, which approaches `offset`. */
  slewedOffset(local: number): number {
    return this.target === null ? 0 : this.slew.at(local);
  }

  /** Return the reference time at `local`. */
  at(local: number): number {
    return local + this.slewedOffset(local);
  }

  private slewTo(target: number, local: number): void {
    if (this.target === null) this.slew.start(target, target, local);
    else this.slew.slewTo(target, local);
    this.target = target;
  }
}
