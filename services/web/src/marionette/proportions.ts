/** Proportions of an arm, in arm lengths and fractions of its mass, and the identity of its bend table. */

import {
  ARM_LENGTH_RATIOS,
  ARM_MASS_RATIOS,
  MAX_ELBOW_BEND_RAD,
  MAX_WRIST_BEND_DEG,
  MIN_TIP_DISTANCE,
  MIN_TIP_DISTANCE_FACTOR,
} from "./constants";

const TOTAL_PARTS = 10_000;
const MASS_PER_LENGTH = ARM_MASS_RATIOS.map((mass, link) => mass / ARM_LENGTH_RATIOS[link]);

/** Lengths of upper arm, forearm and hand (sum 1), and the identity `L0-L1-L2-M0-M1-M2` of their table. */
export interface Proportions {
  readonly upper: number;
  readonly forearm: number;
  readonly hand: number;
  readonly identity: string;
}

/**
 * Return the proportions of links with these lengths and masses in any unit; by default each link has the mass per
 * length of Winter's. Throws `RangeError` for an arm without length or mass.
 */
export function proportionsFromLinks(
  upper: number,
  forearm: number,
  hand: number,
  masses?: readonly [number, number, number],
): Proportions {
  const links = [upper, forearm, hand];
  const whole = upper + forearm + hand;
  if (!(upper > 0 && forearm > 0 && hand > 0)) throw new RangeError("an arm's three links need lengths above zero");
  const weights = masses ?? links.map((length, link) => length * MASS_PER_LENGTH[link]);
  const heavy = weights[0] + weights[1] + weights[2];
  if (!(heavy > 0)) throw new RangeError("an arm's three links need masses above zero");
  const lengths = links.map((length) => length / whole);
  const parts = [...apportion(lengths), ...apportion(weights.map((mass) => mass / heavy))];
  // in thousandths where they say the same
  const identity = (parts.every((part) => part % 10 === 0) ? parts.map((part) => part / 10) : parts).join("-");
  return { upper: lengths[0], forearm: lengths[1], hand: lengths[2], identity };
}

/** Parse an identity. Throws `RangeError` for an invalid one. */
export function parseProportions(identity: string): Proportions {
  const parts = /^\d{1,4}(-\d{1,4}){5}$/.test(identity) ? identity.split("-").map(Number) : [];
  const whole = parts[0] + parts[1] + parts[2];
  if (whole !== 1000 && whole !== TOTAL_PARTS) {
    throw new RangeError(`proportions ${identity} are not L0-L1-L2-M0-M1-M2 in thousandths or ten-thousandths`);
  }
  return { upper: parts[0] / whole, forearm: parts[1] / whole, hand: parts[2] / whole, identity };
}

/** Return the smallest solved distance of the tip: 1.25 times the smallest that the joints allow, at least 0.1. */
export function minTipDistance({ upper, forearm: fore, hand }: Proportions): number {
  let nearest = 1;
  for (let degrees = 0; degrees <= MAX_WRIST_BEND_DEG; degrees++) {
    const bend = (degrees * Math.PI) / 180;
    const x = fore + hand * Math.cos(bend),
      y = hand * Math.sin(bend);
    const lower = Math.hypot(x, y),
      lean = Math.atan2(y, x);
    const turn = Math.min(MAX_ELBOW_BEND_RAD, Math.PI - lean) + lean;
    nearest = Math.min(nearest, Math.hypot(upper + lower * Math.cos(turn), lower * Math.sin(turn)));
  }
  return Math.max(MIN_TIP_DISTANCE, MIN_TIP_DISTANCE_FACTOR * nearest);
}

/** Round to ten-thousandths with sum 10,000, by the largest remainder. */
function apportion(shares: readonly number[]): number[] {
  const whole = shares.map((share) => Math.floor(share * TOTAL_PARTS + 1e-6));
  const order = [0, 1, 2].sort(
    (i, j) => shares[j] * TOTAL_PARTS - whole[j] - (shares[i] * TOTAL_PARTS - whole[i]) || i - j,
  );
  const left = TOTAL_PARTS - whole[0] - whole[1] - whole[2];
  for (let k = 0; k < left; k++) whole[order[k]] += 1;
  return whole;
}
