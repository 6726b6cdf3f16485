/**
 * Offset between two clocks that approaches a target without a step.
 *
 * The approach is exponential, and limited so that the clock with this offset never runs slower than a tenth of real
 * time: the presentation neither jumps nor runs backwards. All numbers are microseconds.
 */

/** Default time constant: a difference of 100 ms shrinks to less than a frame within half a second. */
const SLEW_TIME_CONSTANT_US = 250e3;

/** Upper bound of the decrease of the offset, microseconds per microsecond. */
const MAX_SLEW_RATE = 0.9;

/** Offset that approaches a target. */
export class Slew {
  // the offset was `initial` at local time `startedAt`, and approaches `target`
  private initial = 0;
  private startedAt = 0;
  private target = 0;

  constructor(private readonly timeConstant = SLEW_TIME_CONSTANT_US) {}

  /** Set the offset to `initial` at local time `local`, and its target. */
  start(initial: number, target: number, local: number): void {
    this.initial = initial;
    this.startedAt = local;
    this.target = target;
  }

  /** Change the target from local time `local` on. */
  slewTo(target: number, local: number): void {
    this.start(this.at(local), target, local);
  }

  /** Return the offset at local time `local`. */
  at(local: number): number {
    const { timeConstant } = this;
    let difference = this.initial - this.target;
    let elapsed = Math.max(local - this.startedAt, 0);
    if (difference > MAX_SLEW_RATE * timeConstant) {
      // the exponential would exceed the rate here, so decrease at the constant maximum rate first
      const limited = Math.min((difference - MAX_SLEW_RATE * timeConstant) / MAX_SLEW_RATE, elapsed);
      difference -= MAX_SLEW_RATE * limited;
      elapsed -= limited;
    }
    return this.target + difference * Math.exp(-elapsed / timeConstant);
  }
}
