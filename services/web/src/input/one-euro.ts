/**
 * One-Euro filter of vectors (Casiez, Roussel, Vogel: "1€ Filter", CHI 2012): slow movement is smoothed, fast movement
 * is followed. Pure. The cutoff grows with the speed of the whole vector, so that movements keep their direction.
 * `client/one_euro.py` is the same filter in Python.
 */

export interface OneEuroSettings {
  /** Cutoff at rest in Hz: lower is steadier. */
  minCutoff: number;
  /** Cutoff added per unit of speed, in Hz per unit per second: higher lags less. */
  beta: number;
  /** Cutoff of the smoothing of the speed, in Hz. */
  derivativeCutoff: number;
}

/** Samples closer than this have the same time, in seconds. */
const MIN_INTERVAL_S = 1e-6;

interface FilterState {
  seconds: number;
  value: Float64Array;
  speed: Float64Array;
}

export class OneEuro {
  #previous: FilterState | null = null;
  #current: FilterState | null = null;

  constructor(
    private readonly dimensions: number,
    public settings: OneEuroSettings,
  ) {}

  /**
   * Return the filtered value of a sample. The first sample and constant values pass unchanged. Times may be irregular;
   * of several samples with the same or an earlier time, the last replaces the others.
   *
   * @throws RangeError if the number of values is wrong or one is not finite
   */
  filter(values: ArrayLike<number>, seconds: number): Float64Array {
    if (values.length !== this.dimensions || !Array.from(values).every(Number.isFinite) || !Number.isFinite(seconds)) {
      throw new RangeError(
        `A sample needs ${this.dimensions} finite numbers and a time: ${Array.from(values).join(", ")} at ${seconds}.`,
      );
    }
    if (this.#current && seconds - this.#current.seconds >= MIN_INTERVAL_S) this.#previous = this.#current;
    else if (this.#current) seconds = this.#current.seconds;
    this.#current = this.#previous
      ? this.#step(this.#previous, values, seconds)
      : { seconds, value: Float64Array.from(values), speed: new Float64Array(this.dimensions) };
    return this.#current.value.slice();
  }

  /** Forget all samples: the next one is the first. */
  reset(): void {
    this.#previous = this.#current = null;
  }

  #step(previous: FilterState, values: ArrayLike<number>, seconds: number): FilterState {
    const { minCutoff, beta, derivativeCutoff } = this.settings;
    const interval = seconds - previous.seconds;
    const speedWeight = lowPassWeight(derivativeCutoff, interval);
    const speed = previous.speed.map(
      (old, axis) => old + speedWeight * ((values[axis] - previous.value[axis]) / interval - old),
    );
    const valueWeight = lowPassWeight(minCutoff + beta * Math.hypot(...speed), interval);
    // In this form a constant passes bit for bit.
    const value = previous.value.map((old, axis) => old + valueWeight * (values[axis] - old));
    return { seconds, value, speed };
  }
}

/** Return the weight of a new sample in a low-pass filter with a cutoff in Hz after an interval in seconds. */
function lowPassWeight(cutoff: number, interval: number): number {
  const omega = 2 * Math.PI * cutoff * interval;
  return omega / (omega + 1);
}

/** Cutoffs at rest of the least and the most smoothing, in Hz. */
const REST_CUTOFFS_HZ = [8, 0.6] as const;

/** Return the settings for an amount of smoothing, 0 (none) to 1; `beta` depends on the unit. Null for none. */
export function smoothingSettings(amount: number, beta: number): OneEuroSettings | null {
  if (!(amount > 0)) return null;
  return {
    minCutoff: REST_CUTOFFS_HZ[0] * (REST_CUTOFFS_HZ[1] / REST_CUTOFFS_HZ[0]) ** Math.min(amount, 1),
    beta,
    derivativeCutoff: 1,
  };
}
