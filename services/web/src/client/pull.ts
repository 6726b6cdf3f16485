/**
 * What the inputs of one limb say: where it should be. The value is a hand's place (arm lengths, in the shoulder's frame) or the
 * thigh's angle (radians, first of three). A target is gone to evenly, in the time between the last two inputs, so that a stream
 * of them is a line and not a stair; a velocity moves the value until the next input. As the session has it
 * (`marionette/steering.py`). Times are local milliseconds and come in as arguments.
 */

import { clampThigh, THIGH_GREATEST, THIGH_LEAST } from "../marionette/leg";
import { limbOf } from "../wire/limbs";

/** Full speed of a hand, arm lengths a second along each axis. */
export const HAND_SPEED = 1;
/** Full speed of a leg, radians a second. */
export const LEG_SPEED = 2;
/** How far a hand is pulled from its shoulder, arm lengths. */
export const REACH = 1;
/** The angles a thigh is pulled to, radians forwards from straight down. */
export const THIGH: readonly [number, number] = [THIGH_LEAST, THIGH_GREATEST];
/** A target is gone to in this many milliseconds at most. */
const LONGEST_WAY = 33;

export class Pull {
  /** Whether the limb is, or is being, held. */
  held = false;
  /** What was asked for (3), moved on by `move`: what the session is told. It means nothing until `placed`. */
  readonly value = new Float64Array(3);
  /** Whether the value is known: it is where the limb is when it is first drawn, or the first target. */
  placed = false;

  private readonly velocity = new Float64Array(3);
  private movedAt = 0;
  /** The way to the last target: from where, since when, how long. */
  private readonly start = new Float64Array(3);
  private inputAt = 0;
  private way = 0;
  private readonly between = new Float64Array(3);

  constructor(readonly limb: number) {}

  private get isHand(): boolean {
    return limbOf(this.limb) < 2;
  }

  /** Takes the limb; it stays where it is until it is told otherwise. */
  take(nowMs: number): void {
    if (this.held) return;
    this.held = true;
    this.placed = false;
    this.velocity.fill(0);
    this.way = 0;
    this.movedAt = this.inputAt = nowMs;
  }

  /** Lets the limb go. */
  letGo(): void {
    this.velocity.fill(0);
    this.held = false;
  }

  /** Says where the limb was when it was taken, unless an input said where it should be before. */
  begin(place: Float64Array, nowMs: number): void {
    if (this.placed) return;
    this.set(place[0], place[1], place[2]);
    this.placed = true;
    this.movedAt = nowMs;
  }

  /** Asks for a place; one out of reach is brought in. */
  target(x: number, y: number, z: number, nowMs: number): void {
    this.start.set(this.wanted(nowMs));
    this.way = this.placed ? Math.min(nowMs - this.inputAt, LONGEST_WAY) : 0;
    this.set(x, y, z);
    this.placed = true;
    this.velocity.fill(0);
    this.inputAt = nowMs;
  }

  /** Moves on from where it is at -1..1 of full speed along each axis. */
  speed(x: number, y: number, z: number, nowMs: number): void {
    this.value.set(this.wanted(nowMs));
    this.way = 0;
    const full = this.isHand ? HAND_SPEED : LEG_SPEED;
    this.velocity[0] = Math.min(Math.max(x, -1), 1) * full;
    this.velocity[1] = this.isHand ? Math.min(Math.max(y, -1), 1) * full : 0;
    this.velocity[2] = this.isHand ? Math.min(Math.max(z, -1), 1) * full : 0;
    this.inputAt = nowMs;
  }

  /** Brings the value to `nowMs`. */
  move(nowMs: number): void {
    const seconds = Math.max(nowMs - this.movedAt, 0) / 1000;
    this.movedAt = Math.max(nowMs, this.movedAt);
    const { value, velocity } = this;
    if (!this.placed || (velocity[0] === 0 && velocity[1] === 0 && velocity[2] === 0)) return;
    this.set(value[0] + velocity[0] * seconds, value[1] + velocity[1] * seconds, value[2] + velocity[2] * seconds);
  }

  /** Where the limb should be at `nowMs` (3): on the way to what was asked for. The storage is used again by the next call. */
  wanted(nowMs: number): Float64Array {
    this.move(nowMs);
    const { between, start, value, way } = this;
    const share = way > 0 ? Math.min(Math.max(nowMs - this.inputAt, 0) / way, 1) : 1;
    for (let i = 0; i < 3; i++) between[i] = share < 1 ? start[i] + share * (value[i] - start[i]) : value[i];
    return between;
  }

  private set(x: number, y: number, z: number): void {
    const { value } = this;
    if (!this.isHand) {
      value[0] = clampThigh(x);
      return;
    }
    const scale = Math.min(1, REACH / Math.hypot(x, y, z));
    value[0] = x * scale;
    value[1] = y * scale;
    value[2] = z * scale;
  }
}
