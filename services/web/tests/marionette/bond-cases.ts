/** Cases of `proto/vectors/bonds.json`: two shoulders that move by a formula, and what their hands are asked for. */

import { Bond, type BondedHand, isInReach, recencyShare } from "../../src/marionette/bond";
import type { Pair, Shoulder } from "../../src/marionette/carrier";
import type { Point } from "../../src/marionette/point";
import { fromRotationVector } from "../../src/motion/rotation";

/** Position and rotation vector: base + swing * sin(2 pi hertz t + phase). */
export interface ShoulderPath {
  base: [Point, Point];
  swing: [Point, Point];
  hertz: [Point, Point];
  phase: [Point, Point];
  arm_length_m: number;
  min_tip_distance: number;
}

export interface BondCase {
  shoulders: [ShoulderPath, ShoulderPath];
  hands: [{ place: Point; velocity: Point }, { place: Point; velocity: Point }];
  asked: [number, 0 | 1, Point][];
  every: number;
  frames: [number, Point, Point][];
}

/** Return a shoulder of a case at a time. */
export function shoulderAt(path: ShoulderPath, seconds: number): Shoulder {
  const at = (row: 0 | 1, axis: number) =>
    path.base[row][axis] +
    path.swing[row][axis] * Math.sin(2 * Math.PI * path.hertz[row][axis] * seconds + path.phase[row][axis]);
  const rotation = new Float64Array(4);
  fromRotationVector(rotation, 0, at(1, 0), at(1, 1), at(1, 2));
  return {
    position: [at(0, 0), at(0, 1), at(0, 2)],
    rotation,
    armLengthM: path.arm_length_m,
    minTipDistance: path.min_tip_distance,
  };
}

/** Call `onFrame` for each frame of a case, `seconds` apart, until the bond ends. */
export function playBond(
  { shoulders, hands, asked }: BondCase,
  seconds: number,
  onFrame: (frame: number, bond: Bond, pair: Pair<Shoulder>) => void,
): void {
  const goals: [Point | null, Point | null] = [null, null],
    ages = [Infinity, Infinity];
  let bond: Bond | null = null;
  for (let frame = 0; frame < 180; frame++) {
    for (const side of [0, 1]) ages[side] += seconds;
    for (const [begin, side, place] of asked)
      if (begin === frame) {
        goals[side] = place;
        ages[side] = 0;
      }
    const pair = [shoulderAt(shoulders[0], frame * seconds), shoulderAt(shoulders[1], frame * seconds)] as const;
    const bonded: Pair<BondedHand> = [
      { shoulder: pair[0], goal: goals[0] },
      { shoulder: pair[1], goal: goals[1] },
    ];
    const share = recencyShare(ages[0], ages[1]);
    if (!isInReach(...pair)) return;
    if (!bond) bond = new Bond(bonded, hands, share);
    else if (!bond.step(bonded, share, seconds)) return;
    onFrame(frame, bond, pair);
  }
}
