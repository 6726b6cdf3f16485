/**
 * A difference between two clocks that closes on another and never steps: exponentially, and the clock it is added to never runs
 * slower than a tenth of its speed, so what is shown by it neither jumps nor runs backwards. All numbers are microseconds.
 */

/** Time constant, unless another is asked for: a difference of 100 ms is made good to a frame within half a second. */
const SLEW_TIME_CONSTANT_US = 250e3;

/** How much slower than real the clock may run. */
const MAX_SLEW_RATE = 0.9;

export class Slew {
  // the difference was `from` at local time `since`, and goes to `goal`
  private initial = 0;
  private startedAt = 0;
  private target = 0;

  constructor(private readonly timeConstant = SLEW_TIME_CONSTANT_US) {}

  /** At local time `local` the difference is `from`, at once, and goes to `goal`. */
  start(initial: number, target: number, local: number): void {
    this.initial = initial;
    this.startedAt = local;
    this.target = target;
  }

  /** From local time `local` on it goes to `goal`. */
  slewTo(target: number, local: number): void {
    this.start(this.at(local), target, local);
  }

  /** The difference at `local`. */
  at(local: number): number {
    const { timeConstant: constant } = this;
    let away = this.initial - this.target;
    let elapsed = Math.max(local - this.startedAt, 0);
    if (away > MAX_SLEW_RATE * constant) {
      // far ahead: the exponential would run backwards, so go at the slowest speed until it no longer does
      const until = Math.min((away - MAX_SLEW_RATE * constant) / MAX_SLEW_RATE, elapsed);
      away -= MAX_SLEW_RATE * until;
      elapsed -= until;
    }
    return this.target + away * Math.exp(-elapsed / constant);
  }
}
