/** Samples between samples: a sinc of 16 taps under a Kaiser window (Smith, Digital Audio Resampling, CCRMA). Pure. */

/** Samples that are needed before and after the place that is asked for. */
export const HALF_TAPS = 8;
const TAPS = 2 * HALF_TAPS;
const PHASES = 256;
const KAISER_BETA = 8;

/** Modified Bessel function of the first kind, order 0. */
function besselI0(x: number): number {
  let sum = 1;
  for (let k = 1, term = 1; term > sum * 1e-12; k++) {
    term *= (x / (2 * k)) ** 2;
    sum += term;
  }
  return sum;
}

/** Weights [phase 0..PHASES][tap], of each phase with a sum of one. */
const kernel = Float64Array.from({ length: (PHASES + 1) * TAPS });
for (let phase = 0; phase <= PHASES; phase++) {
  const row = kernel.subarray(phase * TAPS, (phase + 1) * TAPS);
  for (let tap = 0; tap < TAPS; tap++) {
    const x = tap - (HALF_TAPS - 1) - phase / PHASES;
    const sinc = x === 0 ? 1 : Math.sin(Math.PI * x) / (Math.PI * x);
    row[tap] = sinc * besselI0(KAISER_BETA * Math.sqrt(Math.max(1 - (x / HALF_TAPS) ** 2, 0)));
  }
  const sum = row.reduce((total, weight) => total + weight, 0);
  for (let tap = 0; tap < TAPS; tap++) row[tap] /= sum;
}

/**
 * Writes `out[first..end)`: what `samples` are at the places `at`, `at + speed`, ... A place counts from `samples[HALF - 1]`, so
 * that the samples before and after are there: `samples` has `HALF - 1` before place 0 and `HALF` beyond the last place.
 */
export function resample(
  samples: Float32Array,
  at: number,
  speed: number,
  out: Float32Array,
  first: number,
  end: number,
): void {
  for (let frame = first; frame < end; frame++) {
    const place = at + (frame - first) * speed;
    const whole = Math.floor(place);
    const phase = (place - whole) * PHASES;
    if (phase === 0) {
      out[frame] = samples[whole + HALF_TAPS - 1];
      continue;
    }
    const row = Math.floor(phase);
    const mix = phase - row;
    let low = 0,
      high = 0;
    for (let tap = 0, weight = row * TAPS; tap < TAPS; tap++, weight++) {
      const sample = samples[whole + tap];
      low += sample * kernel[weight];
      high += sample * kernel[weight + TAPS];
    }
    out[frame] = low + mix * (high - low);
  }
}
