/**
 * Common reach of two hands: the points that both can be moved to (proto/control.md, 5.10). Each hand reaches a shell
 * around its shoulder. All points (3) and lengths are in one frame and one unit. Python:
 * `marionette/bond/common_reach.py`.
 */

import {
  add,
  anyPerpendicularTo,
  distanceOf,
  dotOf,
  lengthOf,
  type Point,
  rejected,
  scaled,
  subtract,
  unitOr,
} from "./point";

/** Distance by which a point may be outside a shell, for rounding. */
export const TOLERANCE = 1e-9;
const DOWN: Point = [0, -1, 0];

/** Points at distances from `inner` to `outer` from `centre`. */
export interface Shell {
  readonly centre: Point;
  readonly inner: number;
  readonly outer: number;
}

/** Return by how much a point is beyond the outer and within the inner sphere; negative for a distance left. */
function excesses({ centre, inner, outer }: Shell, point: Point): [number, number] {
  const distance = distanceOf(point, centre);
  return [distance - outer, inner - distance];
}

function contains(shell: Shell, point: Point): boolean {
  return Math.max(...excesses(shell, point)) <= TOLERANCE;
}

/** Return the point in the direction of `point` at a distance from the centre; straight down for the centre itself. */
function atDistance({ centre }: Shell, point: Point, distance: number): Point {
  return add(centre, scaled(unitOr(subtract(point, centre), DOWN), distance));
}

/** Return the point of the shell that is nearest to `point`. */
export function nearestInShell(shell: Shell, point: Point): Point {
  const distance = distanceOf(point, shell.centre);
  if (shell.inner <= distance && distance <= shell.outer) return point;
  return atDistance(shell, point, Math.min(Math.max(distance, shell.inner), shell.outer));
}

/**
 * Return the point of both shells that is nearest to `point`, null if they have no point in common. It is `point`
 * itself, the nearest point of one of the four spheres, or that of a circle in which two of them meet.
 */
export function nearestCommonPoint(point: Point, first: Shell, second: Shell): Point | null {
  if (contains(first, point) && contains(second, point)) return point;
  let nearest: Point | null = null,
    least = 0;
  for (const candidate of borderPoints(point, first, second)) {
    if (!contains(first, candidate) || !contains(second, candidate)) continue;
    const distance = distanceOf(candidate, point);
    if (nearest && distance >= least) continue;
    nearest = candidate;
    least = distance;
  }
  return nearest;
}

function borderPoints(point: Point, first: Shell, second: Shell): Point[] {
  const found = [first, second].flatMap((shell) => [
    atDistance(shell, point, shell.outer),
    atDistance(shell, point, shell.inner),
  ]);
  const between = subtract(second.centre, first.centre);
  const distance = lengthOf(between);
  if (distance < 1e-12) return found;
  const axis = scaled(between, 1 / distance);
  for (const one of [first.outer, first.inner])
    for (const other of [second.outer, second.inner]) {
      const along = (distance * distance + one * one - other * other) / (2 * distance);
      const square = one * one - along * along;
      if (square < 0) continue;
      const middle = add(first.centre, scaled(axis, along));
      const side = unitOr(rejected(subtract(point, middle), axis), anyPerpendicularTo(axis));
      found.push(add(middle, scaled(side, Math.sqrt(square))));
    }
  return found;
}

/** Distance of a point from a surface that it must not pass; negative beyond it. */
export interface Gap {
  readonly distance: number;
  /** Unit vector to the surface. */
  readonly normal: Point;
  /** Velocity of the surface along the normal. */
  readonly retreat: number;
}

/** Border that a point must not pass. */
export interface Border {
  /** Return the gaps of a point to the surfaces. */
  gaps(point: Point): Gap[];
  /** Return a velocity shortened so that `acceleration` suffices to follow the outer spheres at it. */
  limitSpeed(velocity: Point, acceleration: number): Point;
}

/** Return the border of a shell that moves at the velocity `drift`: both its spheres. */
export function shellBorder(shell: Shell, drift: Point): Border {
  return {
    gaps(point) {
      const outward = unitOr(subtract(point, shell.centre), DOWN);
      const inward = scaled(outward, -1);
      const [beyond, within] = excesses(shell, point);
      return [
        { distance: -beyond, normal: outward, retreat: dotOf(drift, outward) },
        { distance: -within, normal: inward, retreat: dotOf(drift, inward) },
      ];
    },
    limitSpeed(velocity, acceleration) {
      const relative = subtract(velocity, drift);
      const speed = lengthOf(relative),
        most = Math.sqrt(acceleration * shell.outer);
      return speed <= most ? velocity : add(drift, scaled(relative, most / speed));
    },
  };
}

/**
 * Return the border of the common reach of two shells that move at the velocities `drifts`.
 *
 * Where the outer spheres meet they form a sharp rim. A point that slides along one sphere would have to stop there at
 * once, so the distance from the rim is a gap, too: to the cylinder through it, if that encloses the reach.
 */
export function commonBorder([first, second]: readonly [Shell, Shell], drifts: readonly [Point, Point]): Border {
  const borders = [shellBorder(first, drifts[0]), shellBorder(second, drifts[1])];
  const limitSpeed = (velocity: Point, acceleration: number) =>
    borders.reduce((limited, border) => border.limitSpeed(limited, acceleration), velocity);
  const gapsOf = (point: Point) => {
    const gaps = borders.flatMap((border) => border.gaps(point));
    const between = subtract(second.centre, first.centre);
    const distance = lengthOf(between);
    if (distance < 1e-12) return gaps;
    const along = (distance * distance + first.outer * first.outer - second.outer * second.outer) / (2 * distance);
    const square = first.outer * first.outer - along * along;
    if (!(along > 0 && along < distance) || square <= 0) return gaps;
    const axis = scaled(between, 1 / distance),
      radius = Math.sqrt(square);
    const away = rejected(subtract(point, first.centre), axis);
    const normal = unitOr(away, anyPerpendicularTo(axis));
    const apart = subtract(drifts[1], drifts[0]);
    const centreDrift = add(drifts[0], scaled(apart, along / distance));
    const growth = ((-along * (distance - along)) / (distance * radius)) * dotOf(apart, axis);
    gaps.push({ distance: radius - lengthOf(away), normal, retreat: dotOf(centreDrift, normal) + growth });
    return gaps;
  };
  return { gaps: gapsOf, limitSpeed };
}
