/**
 * Bond of two hands: their tips stay together, whoever moves them (proto/control.md, 5.10).
 *
 * The pair is one point that follows the mean of both hands' goals at a bounded acceleration, within the common reach.
 * The mean is weighted by how recently each goal was set. The point is carried along by the shoulders with the same
 * weights. A bond begins with the hands apart: each has an offset from the point, which is reduced to zero. Positions
 * and velocities are in the world, in metres, unless stated otherwise. Python: `marionette/bond/bond.py`.
 */

import { Carrier, inverse, type Pair, type Shoulder, toWorld } from "./carrier";
import { nearestCommonPoint, nearestInShell, type Shell, shellBorder } from "./common-reach";
import {
  BOND_BEGIN_ACCELERATION,
  BOND_BORDER_MARGIN,
  BOND_JOIN_ACCELERATION,
  HAND_ACCELERATION,
  MAX_BOND_BEGIN_SPEED,
  MAX_BOND_STRETCH,
  MAX_LIMB_SPEED,
  MAX_REACH,
  MAX_TARGET_SPEED,
  MAX_TIP_DISTANCE,
  MIN_REACH,
  RECENCY_HALF_LIFE_S,
  SHARE_HALF_LIFE_S,
} from "./constants";
import { pathTo } from "./follower";
import { add, distanceOf, dotOf, lengthOf, ORIGIN, type Point, rotated, scaled, subtract, unitOr } from "./point";
import { brakingSpeed, keepWithin, limitChange, steer, wallBefore } from "./steering";

/** Distance and speed below which a hand counts as joined to the pair. */
const JOINED_DISTANCE_M = 1e-9;

/** One hand of a bond in one frame. */
export interface BondedHand {
  readonly shoulder: Shoulder;
  /** Place that its puppeteer asks for, null for a hand that is led. */
  readonly goal: Point | null;
}

/** Place and velocity of a hand in its shoulder's frame, arm lengths and arm lengths per second. */
export interface HandMotion {
  readonly place: Point;
  readonly velocity: Point;
}

/** Position and velocity in the carried frame. */
type State = Pair<Point>;

/** Return the share (0..1) of the first of two goals that were set these times ago; Infinity for never. */
export function recencyShare(firstAgeS: number, secondAgeS: number): number {
  if (firstAgeS === Infinity || secondAgeS === Infinity)
    return firstAgeS === secondAgeS ? 0.5 : Number(secondAgeS === Infinity);
  const halvings = (firstAgeS - secondAgeS) / RECENCY_HALF_LIFE_S;
  return 1 / (1 + 2 ** Math.min(Math.max(halvings, -60), 60));
}

/** Return true if two hands can be bonded: their shoulders are no further apart than both arms reach. */
export function isInReach(first: Shoulder, second: Shoulder): boolean {
  const shells = [shellOf(first), shellOf(second)] as const;
  const within = MAX_BOND_STRETCH * (shells[0].outer + shells[1].outer);
  return (
    distanceOf(first.position, second.position) <= within && nearestCommonPoint(first.position, ...shells) !== null
  );
}

/** State of one bond, from its first frame on. */
export class Bond {
  private shoulders: Pair<Shoulder>;
  private unitM: number;
  private point: Point;
  private velocity: Point = ORIGIN;
  /** Spread of both shoulders' frames at the pair, in the last frame. */
  private spread: Point = ORIGIN;
  private readonly offsets: [Point, Point];
  private readonly offsetVelocities: [Point, Point] = [ORIGIN, ORIGIN];
  /** Velocities relative to each hand's own shoulder, until the first step. */
  private ownVelocities: Pair<Point> | null;
  private goal: Point | null = null;

  /** Begin with the hands where they are; `share` (0..1) is the weight of the first one's goal. */
  constructor(
    hands: Pair<BondedHand>,
    motions: Pair<HandMotion>,
    public share: number,
  ) {
    this.shoulders = [hands[0].shoulder, hands[1].shoulder];
    this.unitM = shorterArm(this.shoulders);
    const positions = bySide((side) => toWorld(this.shoulders[side], motions[side].place));
    this.ownVelocities = bySide((side) => {
      const { rotation, armLengthM } = this.shoulders[side];
      return scaled(rotated(rotation, motions[side].velocity), armLengthM);
    });
    const middle = this.mean(...positions);
    this.point = nearestCommonPoint(middle, shellOf(this.shoulders[0]), shellOf(this.shoulders[1])) ?? middle;
    this.offsets = bySide((side) => subtract(positions[side], this.point));
  }

  /** Positions of both hands. */
  get positions(): [Point, Point] {
    return bySide((side) => add(this.point, this.offsets[side]));
  }

  /** True if both hands have met. */
  get isJoined(): boolean {
    return (
      this.ownVelocities === null &&
      [...this.offsets, ...this.offsetVelocities].every((offset) => offset.every((component) => component === 0))
    );
  }

  /**
   * Move the pair for `seconds`. Return false, without effect, if the arms have no point in common. `share` is the
   * present `recencyShare`, which the weight of the first goal approaches. At least one hand has a goal.
   */
  step(hands: Pair<BondedHand>, share: number, seconds: number): boolean {
    const shoulders = [hands[0].shoulder, hands[1].shoulder] as const;
    const shells = [shellOf(shoulders[0]), shellOf(shoulders[1])] as const;
    const newShare = share + (this.share - share) * 2 ** (-seconds / SHARE_HALF_LIFE_S);
    const goal = nearestCommonPoint(requestedPoint(hands, newShare), ...shells);
    if (!goal) return false;
    if (seconds <= 0) return true;
    const carrier = new Carrier(this.shoulders, shoulders, newShare);
    // the same velocity, seen from the frame that is carried with the new weights
    this.velocity = add(this.velocity, scaled(this.spread, this.share - newShare));
    this.spread = carrier.spread(this.point, seconds);
    this.share = newShare;
    if (this.ownVelocities) this.beginMoving(this.ownVelocities, shells, carrier, seconds);
    this.ownVelocities = null;
    this.shoulders = shoulders;
    this.unitM = shorterArm(shoulders);
    const begin: State = [carrier.move(this.point), rotated(carrier.rotation, this.velocity)];
    this.movePoint(goal, begin, shells, carrier, seconds);
    this.goal = goal;
    this.reduceOffset(0, begin, carrier, seconds);
    this.reduceOffset(1, begin, carrier, seconds);
    return true;
  }

  /** Move the joined pair to a position next to its own, where the shoulders' limits keep it. */
  stayAt(position: Point): void {
    const moved = subtract(position, this.point);
    if (lengthOf(moved) === 0) return;
    this.point = position;
    const back = unitOr(moved, ORIGIN);
    this.velocity = subtract(this.velocity, scaled(back, Math.min(dotOf(this.velocity, back), 0)));
  }

  private mean(first: Point, second: Point): Point {
    return add(scaled(first, this.share), scaled(second, 1 - this.share));
  }

  /**
   * Set the velocities in the carried frame from those relative to each hand's own shoulder. The point takes what can
   * stop within the common reach, the offsets take the rest.
   */
  private beginMoving(own: Pair<Point>, shells: Pair<Shell>, carrier: Carrier, seconds: number): void {
    const { positions, unitM, offsetVelocities } = this;
    const velocities = bySide((side) => add(own[side], carrier.slip(side, positions[side], seconds)));
    const mean = rotated(carrier.rotation, this.mean(...velocities));
    const maxChange = 0.5 * HAND_ACCELERATION * unitM * seconds;
    const gaps = carrier.border(shells, seconds).gaps(carrier.move(this.point));
    const within = keepWithin(
      mean,
      gaps.map((gap) => wallBefore(gap, maxChange, seconds)),
    );
    const allowed = limitChange(ORIGIN, within, MAX_BOND_BEGIN_SPEED * unitM);
    this.velocity = rotated(inverse(carrier.rotation), allowed);
    for (const side of [0, 1]) offsetVelocities[side] = subtract(velocities[side], this.velocity);
  }

  /** Move the point towards `goal` from its state `[start, before]` in the frame that the shoulders carry. */
  private movePoint(goal: Point, [start, before]: State, shells: Pair<Shell>, carrier: Carrier, seconds: number): void {
    const maxChange = HAND_ACCELERATION * this.unitM * seconds;
    const freeChange = this.isJoined ? maxChange : BOND_BEGIN_ACCELERATION * this.unitM * seconds;
    let goalVelocity = ORIGIN;
    if (this.goal) {
      const moved = scaled(subtract(goal, carrier.move(this.goal)), 1 / seconds);
      if (lengthOf(moved) <= MAX_TARGET_SPEED * this.unitM) goalVelocity = moved;
    }
    const target = subtract(goal, scaled(goalVelocity, seconds));
    const aim = add(goalVelocity, this.approach(start, target, shells, freeChange, seconds));
    const velocity = steer(start, before, aim, carrier.border(shells, seconds), maxChange, seconds, freeChange);
    const after = add(start, scaled(velocity, seconds));
    this.point = nearestCommonPoint(after, shellOf(this.shoulders[0], 0), shellOf(this.shoulders[1], 0)) ?? after;
    this.velocity = scaled(subtract(this.point, start), 1 / seconds);
  }

  /** Return the velocity towards `target`, as for a single hand; the path keeps clear of both shoulders. */
  private approach(start: Point, target: Point, shells: Pair<Shell>, maxChange: number, seconds: number): Point {
    const way = new Float64Array(3),
      scale = 1 / this.unitM;
    let direction = ORIGIN,
      distance = -1;
    for (const { centre, inner } of shells) {
      const from = Float64Array.from(scaled(subtract(start, centre), scale));
      const to = Float64Array.from(scaled(subtract(target, centre), scale));
      const length = pathTo(way, from, to, inner / this.unitM);
      if (length <= distance) continue;
      direction = [way[0], way[1], way[2]];
      distance = length;
    }
    const speed = brakingSpeed(distance * this.unitM, maxChange, seconds);
    return scaled(direction, Math.min(speed, MAX_LIMB_SPEED * this.unitM));
  }

  /** Reduce the offset of one hand within the reach of its arm; the point was in the state `begin`. */
  private reduceOffset(side: 0 | 1, begin: State, carrier: Carrier, seconds: number): void {
    const { offsets, offsetVelocities, unitM, point } = this;
    if (lengthOf(offsets[side]) === 0 && lengthOf(offsetVelocities[side]) === 0) return;
    const away = rotated(carrier.rotation, offsets[side]),
      offsetBefore = rotated(carrier.rotation, offsetVelocities[side]);
    const start = add(begin[0], away),
      before = add(begin[1], offsetBefore);
    const joinChange = BOND_JOIN_ACCELERATION * unitM * seconds;
    const speed = Math.min(brakingSpeed(lengthOf(away), joinChange, seconds), MAX_LIMB_SPEED * unitM);
    const join = limitChange(offsetBefore, scaled(unitOr(away, ORIGIN), -speed), joinChange);
    const { position: centre, armLengthM: scale, minTipDistance } = this.shoulders[side];
    const shell: Shell = { centre, inner: minTipDistance * scale, outer: MAX_TIP_DISTANCE * scale };
    const border = shellBorder(shell, carrier.drift(side, seconds));
    const maxChange = HAND_ACCELERATION * unitM * seconds;
    const steered = steer(start, before, add(this.velocity, join), border, maxChange, seconds);
    const reached = nearestInShell(shell, add(start, scaled(steered, seconds)));
    const offset = subtract(reached, point);
    const velocity = subtract(scaled(subtract(reached, start), 1 / seconds), this.velocity);
    const hasArrived = lengthOf(offset) < JOINED_DISTANCE_M;
    offsets[side] = hasArrived ? ORIGIN : offset;
    offsetVelocities[side] = hasArrived && lengthOf(velocity) < JOINED_DISTANCE_M ? ORIGIN : velocity;
  }
}

function bySide<T>(value: (side: 0 | 1) => T): [T, T] {
  return [value(0), value(1)];
}

function shorterArm(shoulders: Pair<Shoulder>): number {
  return Math.min(shoulders[0].armLengthM, shoulders[1].armLengthM);
}

/** Return the mean of the goals, or the only one. */
function requestedPoint(hands: Pair<BondedHand>, share: number): Point {
  const [first, second] = bySide((side) => {
    const { shoulder, goal } = hands[side];
    return goal && toWorld(shoulder, goal);
  });
  if (first && second) return add(scaled(first, share), scaled(second, 1 - share));
  const only = first ?? second;
  if (!only) throw new Error("a bond needs the goal of at least one hand");
  return only;
}

/** Return the reach of an arm for a bond; `margin` is in arm lengths. */
function shellOf({ position, armLengthM, minTipDistance }: Shoulder, margin = BOND_BORDER_MARGIN): Shell {
  return {
    centre: position,
    inner: (Math.max(MIN_REACH, minTipDistance) + margin) * armLengthM,
    outer: (MAX_REACH - margin) * armLengthM,
  };
}
