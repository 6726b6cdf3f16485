/**
 * A difference between two clocks that closes on another and never steps: exponentially, and the clock it is added to never runs
 * slower than a tenth of its speed, so what is shown by it neither jumps nor runs backwards. All numbers are microseconds.
 */

/** Time constant, unless another is asked for: a difference of 100 ms is made good to a frame within half a second. */
const GENTLE = 250e3;

/** How much slower than real the clock may run. */
const SLOWEST = 0.9;

export class Slew {
  // the difference was `from` at local time `since`, and goes to `goal`
  private from = 0;
  private since = 0;
  private goal = 0;

  constructor(private readonly constant = GENTLE) {}

  /** At local time `local` the difference is `from`, at once, and goes to `goal`. */
  start(from: number, goal: number, local: number): void {
    this.from = from;
    this.since = local;
    this.goal = goal;
  }

  /** From local time `local` on it goes to `goal`. */
  aim(goal: number, local: number): void {
    this.start(this.at(local), goal, local);
  }

  /** The difference at `local`. */
  at(local: number): number {
    const { constant } = this;
    let away = this.from - this.goal;
    let elapsed = Math.max(local - this.since, 0);
    if (away > SLOWEST * constant) {
      // far ahead: the exponential would run backwards, so go at the slowest speed until it no longer does
      const until = Math.min((away - SLOWEST * constant) / SLOWEST, elapsed);
      away -= SLOWEST * until;
      elapsed -= until;
    }
    return this.goal + away * Math.exp(-elapsed / constant);
  }
}
