/** Points and vectors as three numbers that are never changed, for code that runs a few times per frame. */

import { type Numbers, rotate } from "../motion/rotation";

/** Point or vector: x, y, z. */
export type Point = readonly [number, number, number];

export const ORIGIN: Point = [0, 0, 0];

/** Return the sum. */
export function add(a: Point, b: Point): Point {
  return [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
}

/** Return `a` minus `b`. */
export function subtract(a: Point, b: Point): Point {
  return [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
}

/** Return `a` times `factor`. */
export function scaled(a: Point, factor: number): Point {
  return [a[0] * factor, a[1] * factor, a[2] * factor];
}

/** Return the scalar product. */
export function dotOf(a: Point, b: Point): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/** Return the length. */
export function lengthOf(a: Point): number {
  return Math.sqrt(dotOf(a, a));
}

/** Return the distance of two points. */
export function distanceOf(a: Point, b: Point): number {
  return lengthOf(subtract(a, b));
}

/** Return `a` scaled to unit length, or `fallback` if it has none. */
export function unitOr(a: Point, fallback: Point): Point {
  const size = lengthOf(a);
  return size > 1e-12 ? scaled(a, 1 / size) : fallback;
}

/** Return the part of `a` perpendicular to the unit vector `axis`. */
export function rejected(a: Point, axis: Point): Point {
  return subtract(a, scaled(axis, dotOf(a, axis)));
}

/** Return the right-handed vector product. */
function crossOf(a: Point, b: Point): Point {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

/** Return a unit vector perpendicular to the unit vector `axis`. */
export function anyPerpendicularTo(axis: Point): Point {
  const seed: Point = Math.abs(axis[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0];
  return unitOr(crossOf(axis, seed), seed);
}

/** Return `a` rotated by the unit quaternion `q` (4). */
export function rotated(q: Numbers, a: Point): Point {
  const out = Float64Array.from(a);
  rotate(out, 0, q, 0, out, 0);
  return [out[0], out[1], out[2]];
}
