/**
 * Arms of two bonded hands in one frame: what their bond needs to know of them, and where both can be. Python:
 * `marionette/bond/bonded_arm.py`.
 */

import type { Pose } from "../motion/skeleton";
import type { HandMotion } from "./bond";
import { type Shoulder, toPlace, toWorld } from "./carrier";
import type { ControlledHand } from "./controlled-limb";
import { distanceOf, type Point } from "./point";

/** Rounds in which the arms agree on a position that the shoulder's limit allows both. */
const SETTLE_ROUNDS = 8;
const SETTLED_DISTANCE_M = 1e-9;

/** Arm of one bonded hand in a pose. */
export class BondedArm {
  readonly shoulder: Shoulder;

  /**
   * @param pose pose of the motion on the stage
   * @param seconds time since the frame before
   */
  constructor(
    private readonly hand: ControlledHand,
    private readonly pose: Pose,
    readonly seconds: number,
  ) {
    const { armLengthM, arm } = hand.rig;
    this.shoulder = { ...hand.rig.shoulderFrame(pose), armLengthM, minTipDistance: arm.minTipDistance };
  }

  /** Where the hand is in this frame if nothing moves it. */
  get motion(): HandMotion {
    return this.hand.nextMotion(this.seconds);
  }

  /** Return the position next to `position` that the arm reaches, within the shoulder's limit. */
  reachablePosition(position: Point): Point {
    const place = toPlace(this.shoulder, position);
    return toWorld(this.shoulder, this.hand.reachablePlace(this.pose.rotations, place, this.seconds));
  }
}

/** Return the position next to `position` that both arms reach: each in turn moves it into its own reach. */
export function settle(first: BondedArm, second: BondedArm, position: Point): Point {
  let settled = position;
  for (let round = 0; round < SETTLE_ROUNDS; round++) {
    const reached = second.reachablePosition(first.reachablePosition(settled));
    if (distanceOf(reached, settled) < SETTLED_DISTANCE_M) break;
    settled = reached;
  }
  return settled;
}
