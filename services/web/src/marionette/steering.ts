/**
 * Steering of a point at a bounded acceleration, so that it never passes a border (proto/control.md, 5.10). Velocities
 * (3) are those in the frame that carries the point, `maxChange` is the change of velocity in one step. Python:
 * `marionette/bond/steering.py`.
 */

import { type Border, type Gap, TOLERANCE } from "./common-reach";
import { add, dotOf, lengthOf, type Point, scaled, subtract } from "./point";

/** Rounds in which the limits of several surfaces are applied in turn. */
const WALL_ROUNDS = 4;

/** Limit of a velocity: its component along the unit `normal` is at most `speed`. */
export interface Wall {
  readonly normal: Point;
  readonly speed: number;
}

/**
 * Return the velocity with which a point at `start` nears the velocity `aim`, changed by at most `maxChange`. What the
 * border demands comes first; the rest of the change, up to `maxFreeChange` in all, goes to the aim.
 */
export function steer(
  start: Point,
  before: Point,
  aim: Point,
  border: Border,
  maxChange: number,
  seconds: number,
  maxFreeChange = Infinity,
): Point {
  const freeChange = Math.min(maxChange, maxFreeChange);
  let walls = border.gaps(start).map((gap) => wallBefore(gap, 0.5 * maxChange, seconds));
  // the other half of the change is for the curvature of the border
  const limitedAim = border.limitSpeed(aim, (0.5 * maxChange) / seconds);
  let velocity = before;
  for (let round = 0; round < WALL_ROUNDS; round++) {
    const forced = limitChange(before, keepWithin(before, walls), maxChange);
    velocity = spendChange(before, forced, keepWithin(limitedAim, walls), freeChange);
    // a border is curved: a point that moves along it leaves it
    const gaps = border.gaps(add(start, scaled(velocity, seconds)));
    if (Math.min(...gaps.map(({ distance }) => distance)) >= -TOLERANCE) break;
    walls = walls.map(({ normal, speed }, nth) => ({
      normal,
      speed: speed + Math.min(gaps[nth].distance, 0) / seconds,
    }));
  }
  return velocity;
}

/** Return the limit with which a point can stop before a surface that moves. */
export function wallBefore({ distance, normal, retreat }: Gap, maxChange: number, seconds: number): Wall {
  const before = distance - retreat * seconds;
  const speed = before > 0 ? brakingSpeed(before, maxChange, seconds) : before / seconds;
  return { normal, speed: retreat + speed };
}

/** Return the largest speed from which steps of `maxChange` stop after `distance`. */
export function brakingSpeed(distance: number, maxChange: number, seconds: number): number {
  const speed = maxChange * (Math.sqrt(0.25 + (2 * distance) / (maxChange * seconds)) - 0.5);
  return Math.min(speed, distance / seconds);
}

/** Return a velocity within all limits that is near to `velocity`. */
export function keepWithin(velocity: Point, walls: readonly Wall[]): Point {
  for (let round = 0; round < WALL_ROUNDS; round++)
    for (const { normal, speed } of walls) {
      const excess = dotOf(velocity, normal) - speed;
      if (excess > 0) velocity = subtract(velocity, scaled(normal, excess));
    }
  return velocity;
}

/** Return the velocity nearest to `after` within `maxChange` of `before`, on the way there. */
export function limitChange(before: Point, after: Point, maxChange: number): Point {
  const change = subtract(after, before),
    size = lengthOf(change);
  return size <= maxChange ? after : add(before, scaled(change, maxChange / size));
}

/** Return the velocity farthest on the way from `forced` to `aim` within `maxChange` of `before`, or `forced`. */
function spendChange(before: Point, forced: Point, aim: Point, maxChange: number): Point {
  const path = subtract(aim, forced),
    base = subtract(forced, before);
  const a = dotOf(path, path),
    b = dotOf(path, base),
    c = dotOf(base, base) - maxChange * maxChange;
  if (a + 2 * b + c <= 0) return aim;
  // `forced` is often at `maxChange` itself: the way leads into the sphere or away from it, whatever c is rounded to
  const square = b * b - a * c;
  if (a <= 0 || square < 0 || (c >= 0 && b >= 0)) return forced;
  return add(forced, scaled(path, (Math.sqrt(square) - b) / a));
}
