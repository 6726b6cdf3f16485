/**
 * Prediction of a bond of which this page holds a hand: the pair moves at once, as the session will move it for all.
 *
 * Of a hand that another puppeteer holds, this page knows what the session's overlays show of it: that is the goal of
 * the hand. Its age is the time since the overlays last showed the pair where this page has not moved it. Without an
 * input for a second this page's hand follows the overlays, too. Times are local milliseconds.
 */

import { Bond, type BondedHand, isInReach, recencyShare } from "../marionette/bond";
import { BondedArm, settle } from "../marionette/bonded-arm";
import { type Pair, toPlace } from "../marionette/carrier";
import { MIN_SHARE } from "../marionette/constants";
import type { ControlledHand } from "../marionette/controlled-limb";
import { distanceOf, type Point } from "../marionette/point";
import { applyPlacement } from "../motion/placement";
import { copyPose, type Pose, restPose } from "../motion/skeleton";
import { FOLLOW_DELAY_MS } from "./limb-target";
import type { StagedFrame } from "./performer-view";
import type { PredictedLimb } from "./predicted-limb";

/** Distance from the predicted path, arm lengths, from which on a shown pair is moved by the other puppeteer. */
const UNEXPLAINED_DISTANCE = 0.06;
/** Time for which the predicted path is kept: the longest delay of the overlays. */
const PATH_DURATION_MS = 1_000;

/** Holder of a limb: this page, another puppeteer, or nobody. */
export type LimbHolder = "own" | "other" | null;

/** One hand of a predicted bond, in a frame. */
export interface PredictedHand {
  readonly prediction: PredictedLimb;
  readonly holder: LimbHolder;
  readonly frame: StagedFrame;
}

/** Prediction of one bond. */
export class PredictedBond {
  private bond: Bond | null = null;
  private places: Pair<Point> | null = null;
  private nowMs = -Infinity;
  private readonly stagedPose: Pair<Pose> = [restPose(), restPose()];
  /** Recent predicted places of this page's hand, and the last time at which the overlays showed another one. */
  private path: { readonly atMs: number; readonly place: Point }[] = [];
  private unexplainedAtMs = -Infinity;

  /**
   * Return the places of both hands at the frame's time, of which this page holds one at least; null while the arms have
   * no point in common, where the session ends the bond.
   */
  advance(hands: Pair<PredictedHand>): Pair<Point> | null {
    const { nowMs } = hands[0].frame;
    if (nowMs === this.nowMs) return this.places;
    this.nowMs = nowMs;
    const arms = [this.arm(hands[0], 0), this.arm(hands[1], 1)] as const;
    const positions = this.move(hands, arms);
    if (!positions) {
      this.bond = null;
      return (this.places = null);
    }
    const places = [toPlace(arms[0].shoulder, positions[0]), toPlace(arms[1].shoulder, positions[1])] as const;
    this.followPair(hands, places);
    return (this.places = places);
  }

  private arm({ prediction, frame }: PredictedHand, side: 0 | 1): BondedArm {
    const { controlled, seconds } = prediction.beginFrame(frame);
    const pose = this.stagedPose[side];
    copyPose(frame.motion, pose);
    return new BondedArm(controlled as ControlledHand, applyPlacement(pose, frame.placement), seconds);
  }

  /** Move the pair; return the positions of both hands, null if the arms have no point in common. */
  private move(hands: Pair<PredictedHand>, arms: Pair<BondedArm>): Pair<Point> | null {
    if (!isInReach(arms[0].shoulder, arms[1].shoulder)) return null;
    for (const { prediction, frame } of hands) prediction.leaveMotion(frame);
    const share = this.share(hands);
    const bonded: Pair<BondedHand> = [
      { shoulder: arms[0].shoulder, goal: this.goal(hands[0]) },
      { shoulder: arms[1].shoulder, goal: this.goal(hands[1]) },
    ];
    if (!this.bond) this.bond = new Bond(bonded, [arms[0].motion, arms[1].motion], share);
    else if (!this.bond.step(bonded, share, arms[0].seconds)) return null;
    if (!this.bond.isJoined) return this.bond.positions;
    const settled = settle(arms[0], arms[1], this.bond.positions[0]);
    this.bond.stayAt(settled);
    return [settled, settled];
  }

  /** Return the place that a hand's puppeteer asks for, null if it is led. */
  private goal({ prediction, holder, frame }: PredictedHand): Point | null {
    if (holder === null) return null;
    const { target } = prediction;
    if (holder === "other") return pointOf(prediction.placeIn(frame));
    const { controlled } = prediction.beginFrame(frame);
    target.setStart(controlled.position, frame.nowMs);
    return pointOf(target.valueAt(frame.nowMs));
  }

  /** Return the weight of the first hand's goal, as the session does. */
  private share(hands: Pair<PredictedHand>): number {
    const [first, second] = hands;
    if (!first.holder || !second.holder) return Number(first.holder !== null);
    const own = hands.find(({ holder }) => holder === "own");
    const other = hands.find(({ holder }) => holder === "other");
    const { nowMs } = first.frame;
    const age = ({ prediction }: PredictedHand) => prediction.target.inputAgeS(nowMs);
    if (!own || !other) return recencyShare(age(first), age(second));
    const ownShare = this.shareAgainstOther(own, age(own));
    return own === first ? ownShare : 1 - ownShare;
  }

  /** Return the weight of this page's hand, set `ageS` ago, against that of another puppeteer. */
  private shareAgainstOther({ prediction, frame }: PredictedHand, ageS: number): number {
    const { nowMs } = frame;
    if (prediction.isOverlaidIn(frame)) {
      const shown = prediction.placeIn(frame),
        place = pointOf(shown);
      if (ageS * 1000 >= FOLLOW_DELAY_MS) prediction.target.follow(shown, nowMs);
      const isExplained = this.path.some((earlier) => distanceOf(earlier.place, place) < UNEXPLAINED_DISTANCE);
      if (!isExplained) this.unexplainedAtMs = nowMs;
    }
    return ageS * 1000 >= FOLLOW_DELAY_MS ? 0 : recencyShare(ageS, (nowMs - this.unexplainedAtMs) / 1000);
  }

  /** Let the targets of this page that have no weight follow the pair, and record its path. */
  private followPair(hands: Pair<PredictedHand>, places: Pair<Point>): void {
    const { nowMs, bond } = this;
    const isOwn = hands.every(({ holder }) => holder === "own");
    this.path = this.path.filter(({ atMs }) => atMs > nowMs - PATH_DURATION_MS);
    for (const side of [0, 1] as const) {
      const { prediction, holder } = hands[side];
      if (holder !== "own") continue;
      const weight = side === 0 ? (bond?.share ?? 1) : 1 - (bond?.share ?? 0);
      if (isOwn && weight < MIN_SHARE) prediction.target.follow(Float64Array.from(places[side]), nowMs);
      if (!isOwn) this.path.push({ atMs: nowMs, place: places[side] });
    }
  }
}

function pointOf(numbers: Float64Array): Point {
  return [numbers[0], numbers[1], numbers[2]];
}
