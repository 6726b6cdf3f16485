/** Fractional resampling: a 16-tap sinc under a Kaiser window (Smith, Digital Audio Resampling, CCRMA). Pure. */

/** Samples needed before and after a position. */
export const HALF_TAPS = 8;
const TAPS = 2 * HALF_TAPS;
const PHASES = 256;
const KAISER_BETA = 8;

/** Return the modified Bessel function of the first kind, order 0. */
function besselI0(x: number): number {
  let sum = 1;
  for (let k = 1, term = 1; term > sum * 1e-12; k++) {
    term *= (x / (2 * k)) ** 2;
    sum += term;
  }
  return sum;
}

/** Weights [phase 0..PHASES][tap]; the weights of each phase sum to one. */
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
 * Write `out[first..end)`: the samples at the positions `at`, `at + speed`, ... Position 0 is `samples[HALF_TAPS - 1]`,
 * so that `samples` has `HALF_TAPS - 1` samples before it, and must have `HALF_TAPS` after the last position.
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
    const position = at + (frame - first) * speed;
    const wholeSample = Math.floor(position);
    const phase = (position - wholeSample) * PHASES;
    if (phase === 0) {
      out[frame] = samples[wholeSample + HALF_TAPS - 1];
      continue;
    }
    const row = Math.floor(phase);
    const mix = phase - row;
    let low = 0,
      high = 0;
    for (let tap = 0, weight = row * TAPS; tap < TAPS; tap++, weight++) {
      const sample = samples[wholeSample + tap];
      low += sample * kernel[weight];
      high += sample * kernel[weight + TAPS];
    }
    out[frame] = low + mix * (high - low);
  }
}
