/**
 * Controlled limb on its way to a target, at a bounded acceleration: it accelerates, brakes in time and arrives
 * without overshoot (time-optimal control of a mass with a bounded force in discrete time; Han, From PID to Active
 * Disturbance Rejection Control, 2009). A target at constant velocity is tracked without lag. Python:
 * `marionette/follower_step.py`.
 */

import type { Numbers } from "../motion/rotation";
import {
  addScaled,
  anyPerpendicular,
  distanceBetween,
  dot,
  length,
  rejectFrom,
  setVector,
  unit,
} from "../motion/vector";
import { MAX_LIMB_SPEED, MAX_TARGET_SPEED, SHOULDER_CLEARANCE } from "./constants";

const FORWARDS = Float64Array.of(0, 0, 1);

/** Position and velocity of a hand (arm lengths) or a thigh (radians, the first of three). */
export class Follower {
  readonly position: Float64Array;
  readonly velocity: Float64Array;
  private readonly previousTarget = new Float64Array(3);
  private readonly previousFrameVelocity = new Float64Array(3);
  /** State of the last step: a target, and a moving frame of reference. */
  private hasPreviousTarget = false;
  private hadFrameVelocity = false;
  private readonly ahead = new Float64Array(3);
  private readonly goal = new Float64Array(3);
  private readonly direction = new Float64Array(3);
  private readonly change = new Float64Array(3);
  private readonly before = new Float64Array(3);

  /** Start at `position` (3) with `velocity` (3), which are copied. */
  constructor(position: Numbers, velocity: Numbers) {
    this.position = position.slice();
    this.velocity = velocity.slice();
  }

  /**
   * Move towards `target` for `seconds`.
   *
   * `acceleration` (per second squared) bounds the change of velocity. With `frameVelocity`, the velocity of a
   * moving frame of reference (the limb in the stored motion), it bounds the change relative to that frame, so
   * that the time of the return does not depend on the motion. The distance from the origin stays within
   * `minDistance` and `maxDistance`; a path past the origin keeps `SHOULDER_CLEARANCE` where it can.
   */
  step(
    target: Numbers,
    seconds: number,
    acceleration: number,
    minDistance = 0,
    maxDistance = Infinity,
    frameVelocity: Numbers | null = null,
  ): void {
    if (seconds <= 0) return;
    const { position, velocity, ahead, goal, direction, change, before } = this;
    for (let i = 0; i < 3; i++) {
      ahead[i] = frameVelocity
        ? frameVelocity[i]
        : this.hasPreviousTarget
          ? (target[i] - this.previousTarget[i]) / seconds
          : 0;
      before[i] = frameVelocity ? (this.hadFrameVelocity ? this.previousFrameVelocity[i] : frameVelocity[i]) : 0;
    }
    if (!frameVelocity && length(ahead, 0) > MAX_TARGET_SPEED) ahead.fill(0);
    this.hasPreviousTarget = true;
    this.previousTarget.set(target);
    this.hadFrameVelocity = frameVelocity !== null;
    if (frameVelocity) this.previousFrameVelocity.set(frameVelocity);
    // the remaining path without the part that the target itself will move
    addScaled(goal, 0, target, 0, ahead, 0, -seconds);
    const distance = pathTo(direction, position, goal, minDistance);
    const maxChange = acceleration * seconds;
    // the speed from which steps of the bounded acceleration stop after `distance`
    let speed = maxChange * (Math.sqrt(0.25 + (2 * distance) / (maxChange * seconds)) - 0.5);
    speed = Math.min(speed, distance / seconds, MAX_LIMB_SPEED);
    // in a moving frame all velocities are relative to it
    for (let i = 0; i < 3; i++) {
      const had = velocity[i] - before[i];
      const aim = frameVelocity ? direction[i] * speed : ahead[i] + direction[i] * speed;
      change[i] = aim - had;
      velocity[i] = frameVelocity ? had + ahead[i] : had;
    }
    const size = length(change, 0);
    addScaled(velocity, 0, velocity, 0, change, 0, size > maxChange ? maxChange / size : 1);
    before.set(position);
    addScaled(position, 0, position, 0, velocity, 0, seconds);
    clampDistance(position, minDistance, maxDistance);
    for (let i = 0; i < 3; i++) velocity[i] = (position[i] - before[i]) / seconds;
  }

  /** Move to a position (3) that was computed otherwise, in `seconds`; the next step begins with that velocity. */
  moveTo(target: ArrayLike<number>, seconds: number): void {
    const { position, velocity } = this;
    if (seconds > 0) for (let i = 0; i < 3; i++) velocity[i] = (target[i] - position[i]) / seconds;
    position.set(target);
    this.hasPreviousTarget = this.hadFrameVelocity = false;
  }
}

const aside = new Float64Array(3);

/**
 * Return the length of the path from `position` to `target` (3 each), straight or past a point beside the origin, and
 * write its initial direction (3).
 */
export function pathTo(direction: Numbers, position: Numbers, target: Numbers, minDistance: number): number {
  addScaled(direction, 0, target, 0, position, 0, -1);
  const distance = length(direction, 0);
  if (distance < 1e-12) {
    setVector(direction, 0, 0, 0, 0);
    return 0;
  }
  for (let i = 0; i < 3; i++) direction[i] /= distance;
  if (minDistance <= 0) return distance;
  const along = -dot(position, 0, direction, 0);
  const near = Math.min(SHOULDER_CLEARANCE, length(position, 0), length(target, 0));
  if (!(along > 0 && along < distance)) return distance;
  // the point of the straight path nearest to the origin
  addScaled(aside, 0, position, 0, direction, 0, along);
  const off = length(aside, 0);
  if (off >= near) return distance;
  if (off > 1e-3) unit(aside, 0, aside, 0);
  else {
    // in front of the chest, where a hand that comes straight across has the room
    rejectFrom(aside, 0, FORWARDS, 0, direction, 0);
    if (length(aside, 0) > 0.1) unit(aside, 0, aside, 0);
    else anyPerpendicular(aside, 0, direction, 0);
  }
  for (let i = 0; i < 3; i++) aside[i] *= near;
  const leg = distanceBetween(aside, 0, position, 0);
  if (leg < 1e-9) return distance;
  for (let i = 0; i < 3; i++) direction[i] = (aside[i] - position[i]) / leg;
  return leg + distanceBetween(target, 0, aside, 0);
}

function clampDistance(position: Numbers, minDistance: number, maxDistance: number): void {
  const size = length(position, 0);
  if (size < minDistance) {
    if (!unit(position, 0, position, 0)) setVector(position, 0, 0, -1, 0);
    for (let i = 0; i < 3; i++) position[i] *= minDistance;
  } else if (size > maxDistance) {
    for (let i = 0; i < 3; i++) position[i] *= maxDistance / size;
  }
}
