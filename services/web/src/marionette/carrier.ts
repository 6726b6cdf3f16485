/**
 * Frame that carries a bonded pair: it moves with both shoulders, weighted (proto/control.md, 5.10). Positions and
 * velocities are in the world, in metres, unless stated otherwise. Python: `marionette/bond/carrier.py`.
 */

import { conjugate, fromRotationVector, multiply, type Numbers, toRotationVector } from "../motion/rotation";
import { type Border, commonBorder, type Shell } from "./common-reach";
import { add, type Point, rotated, scaled, subtract } from "./point";

/** Shoulder of a bonded hand, and the reach of its arm. */
export interface Shoulder {
  /** Position of the shoulder joint. */
  readonly position: Point;
  /** Orientation (4) of vl5, in whose axes the hand's places are. */
  readonly rotation: Numbers;
  readonly armLengthM: number;
  /** Smallest distance of the hand tip, arm lengths. */
  readonly minTipDistance: number;
}

/** Two shoulders, or what belongs to them. */
export type Pair<T> = readonly [T, T];

/** Return the inverse of a rotation (4). */
export function inverse(q: Numbers): Numbers {
  const out = new Float64Array(4);
  conjugate(out, 0, q, 0);
  return out;
}

/** Return a place of the hand (arm lengths, the shoulder's frame) as a position. */
export function toWorld(shoulder: Shoulder, place: Point): Point {
  return add(shoulder.position, scaled(rotated(shoulder.rotation, place), shoulder.armLengthM));
}

/** Return a position as a place of the hand. */
export function toPlace(shoulder: Shoulder, position: Point): Point {
  return scaled(rotated(inverse(shoulder.rotation), subtract(position, shoulder.position)), 1 / shoulder.armLengthM);
}

/** Movement of both shoulders in one frame, weighted. */
export class Carrier {
  /** Rotation (4) of the carried frame. */
  readonly rotation = Float64Array.of(1, 0, 0, 0);
  private readonly turns: Numbers[] = [];
  private readonly weights: Pair<number>;

  constructor(
    private readonly before: Pair<Shoulder>,
    private readonly now: Pair<Shoulder>,
    share: number,
  ) {
    this.weights = [share, 1 - share];
    const vector = new Float64Array(3),
      part = new Float64Array(4);
    for (const side of [0, 1] as const) {
      const turn = new Float64Array(4);
      multiply(turn, 0, now[side].rotation, 0, inverse(before[side].rotation), 0);
      this.turns.push(turn);
      toRotationVector(vector, 0, turn, 0);
      const [x, y, z] = vector.map((component) => component * this.weights[side]);
      fromRotationVector(part, 0, x, y, z);
      multiply(this.rotation, 0, this.rotation, 0, part, 0);
    }
  }

  /** Return where a point at rest in the carried frame is now. */
  move(point: Point): Point {
    return add(scaled(this.follow(0, point), this.weights[0]), scaled(this.follow(1, point), this.weights[1]));
  }

  /** Return the velocity in the carried frame of a point at rest in one shoulder's frame, before this frame. */
  slip(side: 0 | 1, point: Point, seconds: number): Point {
    return rotated(inverse(this.rotation), scaled(subtract(this.follow(side, point), this.move(point)), 1 / seconds));
  }

  /** Return the velocity of a point at rest in the first shoulder's frame, seen from the second's. */
  spread(point: Point, seconds: number): Point {
    return scaled(subtract(this.follow(0, point), this.follow(1, point)), 1 / seconds);
  }

  /** Return the velocity of one shoulder in the carried frame. */
  drift(side: 0 | 1, seconds: number): Point {
    return scaled(subtract(this.now[side].position, this.move(this.before[side].position)), 1 / seconds);
  }

  /** Return the border of the common reach, as it moves in the carried frame. */
  border(shells: Pair<Shell>, seconds: number): Border {
    return commonBorder(shells, [this.drift(0, seconds), this.drift(1, seconds)]);
  }

  /** Return where a point at rest in one shoulder's frame is now. */
  private follow(side: 0 | 1, point: Point): Point {
    return add(this.now[side].position, rotated(this.turns[side], subtract(point, this.before[side].position)));
  }
}
