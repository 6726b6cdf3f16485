/**
 * The One-Euro filter (Casiez, Roussel, Vogel: "1€ Filter", CHI 2012) of vectors: slow movement is smoothed, fast movement is followed. Pure. The cutoff grows
 * with the speed of the whole vector, so that a smoothed movement keeps its direction. `client/one_euro.py` is the same in Python.
 */

export interface OneEuroSettings {
  /** Hz, at rest: lower is steadier. */
  minCutoff: number;
  /** Hz for each unit a second of speed: higher lags less. */
  beta: number;
  /** Hz, of the speed's own smoothing. */
  derivativeCutoff: number;
}

/** Samples nearer in time than this are of one time, seconds. */
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
   * The smoothed value of a sample at a time. The first comes through as it is, and so does a constant. Times may be irregular; of several samples of one
   * time, or of an earlier one, the last counts as if it were the only one.
   *
   * @throws RangeError for another number of values, or one that is not finite
   */
  filter(values: ArrayLike<number>, seconds: number): Float64Array {
    if (values.length !== this.dimensions || !Array.from(values).every(Number.isFinite) || !Number.isFinite(seconds)) {
      throw new RangeError(
        `a sample is ${this.dimensions} finite numbers and a time, not ${Array.from(values).join(", ")} at ${seconds}`,
      );
    }
    if (this.#current && seconds - this.#current.seconds >= MIN_INTERVAL_S) this.#previous = this.#current;
    else if (this.#current) seconds = this.#current.seconds;
    this.#current = this.#previous
      ? this.#step(this.#previous, values, seconds)
      : { seconds, value: Float64Array.from(values), speed: new Float64Array(this.dimensions) };
    return this.#current.value.slice();
  }

  /** Forgets what came: the next sample is the first. */
  reset(): void {
    this.#previous = this.#current = null;
  }

  #step(before: FilterState, values: ArrayLike<number>, seconds: number): FilterState {
    const { minCutoff, beta, derivativeCutoff } = this.settings;
    const passed = seconds - before.seconds;
    const slow = lowPassWeight(derivativeCutoff, passed);
    const speed = before.speed.map((old, axis) => old + slow * ((values[axis] - before.value[axis]) / passed - old));
    const much = lowPassWeight(minCutoff + beta * Math.hypot(...speed), passed);
    // written so that a constant comes through to the last bit
    const value = before.value.map((old, axis) => old + much * (values[axis] - old));
    return { seconds, value, speed };
  }
}

/** What a new sample weighs in a low-pass of a cutoff in Hz, after some seconds. */
function lowPassWeight(cutoff: number, interval: number): number {
  const turned = 2 * Math.PI * cutoff * interval;
  return turned / (turned + 1);
}

/** Cutoffs at rest of the least and the most smoothing, Hz. */
const REST_CUTOFFS_HZ = [8, 0.6] as const;

/** A person's wish for smoothness, 0 (none) to 1, as settings; `beta` depends on the unit. Null for none. */
export function smoothingSettings(amount: number, beta: number): OneEuroSettings | null {
  if (!(amount > 0)) return null;
  return {
    minCutoff: REST_CUTOFFS_HZ[0] * (REST_CUTOFFS_HZ[1] / REST_CUTOFFS_HZ[0]) ** Math.min(amount, 1),
    beta,
    derivativeCutoff: 1,
  };
}
