/** Switch with hysteresis, so that a value that trembles about a limit does not flicker. Pure. */
export class Threshold {
  isOn = false;

  /** It switches on at `on` and off at `off`, which is the smaller one. */
  constructor(
    private readonly on: number,
    private readonly off: number,
  ) {}

  /** Update by a value. Return whether it has just switched on. */
  update(value: number): boolean {
    const wasOn = this.isOn;
    this.isOn = wasOn ? value > this.off : value >= this.on;
    return this.isOn && !wasOn;
  }
}
