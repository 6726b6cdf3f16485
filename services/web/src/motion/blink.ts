/**
 * Blinking of a performer whose eyes are not recorded. Pure: the same time and seed give the same blink everywhere.
 * Intervals between spontaneous blinks are close to log-normal; the lids close faster than they open.
 */

/** Durations of a blink, in seconds. */
export const CLOSING_S = 0.08;
export const OPENING_S = 0.15;
/** Blinks are drawn for periods of this length, each from the period's own seed, in seconds. */
const PERIOD_S = 60;
/** Interval: median and spread of the logarithm; drawn within limits that leave room for fitting the period. */
const MEDIAN_INTERVAL_S = 3.8;
const INTERVAL_SPREAD = 0.42;
const MIN_DRAWN_S = 2.2;
const MAX_DRAWN_S = 7.4;
/** Share of blinks that are double, and the time between the starts of both, in seconds. */
const DOUBLE_SHARE = 0.15;
const DOUBLE_INTERVAL_S = 0.31;

/** Return a random number in 0..1 that depends on all arguments. */
export function randomOf(seed: number, ...keys: readonly number[]): number {
  let hash = 0x9e3779b9 ^ seed;
  for (const key of keys) {
    hash = Math.imul(hash ^ key, 0x85ebca6b);
    hash = Math.imul(hash ^ (hash >>> 13), 0xc2b2ae35);
    hash ^= hash >>> 16;
  }
  return (hash >>> 0) / 2 ** 32;
}

/** Return how far the eyes are closed, 0..1, `elapsed` seconds after a blink began. */
export function blinkAt(elapsed: number): number {
  if (!(elapsed > 0 && elapsed < CLOSING_S + OPENING_S)) return 0;
  const share = elapsed < CLOSING_S ? elapsed / CLOSING_S : 1 - (elapsed - CLOSING_S) / OPENING_S;
  return share * share * (3 - 2 * share);
}

/** Return how far the eyes of a performer are closed, 0..1, at a time in seconds. */
export function blinkWeight(seconds: number, seed: number): number {
  // Performers with different seeds do not begin their periods together.
  const time = seconds + PERIOD_S * randomOf(seed, 1);
  const period = Math.floor(time / PERIOD_S);
  const within = time - period * PERIOD_S;
  let closed = 0;
  blinkStarts(seed, period).forEach((start, n) => {
    closed = Math.max(closed, blinkAt(within - start));
    if (randomOf(seed, period, n, 3) < DOUBLE_SHARE)
      closed = Math.max(closed, blinkAt(within - start - DOUBLE_INTERVAL_S));
  });
  return closed;
}

/** Return the times of the blinks in a period, from its begin; the first is at 0. */
function blinkStarts(seed: number, period: number): number[] {
  const starts = [0];
  let end = 0;
  for (let n = 0; end < PERIOD_S - MAX_DRAWN_S / 2; n++) {
    // Box and Muller's normal variate
    const normal =
      Math.sqrt(-2 * Math.log(1 - randomOf(seed, period, n, 1))) * Math.cos(2 * Math.PI * randomOf(seed, period, n, 2));
    const interval = MEDIAN_INTERVAL_S * Math.exp(INTERVAL_SPREAD * normal);
    end += Math.min(Math.max(interval, MIN_DRAWN_S), MAX_DRAWN_S);
    starts.push(end);
  }
  starts.pop();
  return starts.map((start) => (start * PERIOD_S) / end);
}
