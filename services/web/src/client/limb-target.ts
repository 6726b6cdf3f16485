/**
 * What the inputs of one limb say: where it should be. The value is a hand's place (arm lengths, in the shoulder's frame) or the
 * thigh's angle (radians, first of three). A target is gone to evenly, in the time between the last two inputs, so that a stream
 * of them is a line and not a stair; a velocity moves the value until the next input. As the session has it
 * (`marionette/steering.py`). Times are local milliseconds and come in as arguments.
 */

import {
  MAX_HAND_SPEED,
  MAX_LEG_SPEED,
  MAX_TARGET_DURATION_US,
  MAX_THIGH_ANGLE_RAD,
  MIN_THIGH_ANGLE_RAD,
} from "../marionette/constants";
import { clampThigh } from "../marionette/leg";
import { limbWithinPerformer } from "../wire/limbs";

export { MAX_HAND_SPEED, MAX_LEG_SPEED };

/** How far a hand is pulled from its shoulder, arm lengths. */
export const MAX_TARGET_REACH = 1;
/** The angles a thigh is pulled to, radians forwards from straight down. */
export const THIGH_RANGE: readonly [number, number] = [MIN_THIGH_ANGLE_RAD, MAX_THIGH_ANGLE_RAD];
/** A target is gone to in this many milliseconds at most. */
const MAX_TARGET_DURATION_MS = MAX_TARGET_DURATION_US / 1000;

export class LimbTarget {
  /** Whether the limb is, or is being, held. */
  isHeld = false;
  /** What was asked for (3), moved on by `move`: what the session is told. It means nothing until `placed`. */
  readonly value = new Float64Array(3);
  /** Whether the value is known: it is where the limb is when it is first drawn, or the first target. */
  isKnown = false;

  private readonly velocity = new Float64Array(3);
  private movedAt = 0;
  /** The way to the last target: from where, since when, how long. */
  private readonly start = new Float64Array(3);
  private inputAt = 0;
  private durationMs = 0;
  private readonly interpolated = new Float64Array(3);

  constructor(readonly limb: number) {}

  private get isHand(): boolean {
    return limbWithinPerformer(this.limb) < 2;
  }

  /** Takes the limb; it stays where it is until it is told otherwise. */
  take(nowMs: number): void {
    if (this.isHeld) return;
    this.isHeld = true;
    this.isKnown = false;
    this.velocity.fill(0);
    this.durationMs = 0;
    this.movedAt = this.inputAt = nowMs;
  }

  /** Lets the limb go. */
  release(): void {
    this.velocity.fill(0);
    this.isHeld = false;
  }

  /** Says where the limb was when it was taken, unless an input said where it should be before. */
  setStart(position: Float64Array, nowMs: number): void {
    if (this.isKnown) return;
    this.set(position[0], position[1], position[2]);
    this.isKnown = true;
    this.movedAt = nowMs;
  }

  /** Asks for a place; one out of reach is brought in. */
  setTarget(x: number, y: number, z: number, nowMs: number): void {
    this.start.set(this.valueAt(nowMs));
    this.durationMs = this.isKnown ? Math.min(nowMs - this.inputAt, MAX_TARGET_DURATION_MS) : 0;
    this.set(x, y, z);
    this.isKnown = true;
    this.velocity.fill(0);
    this.inputAt = nowMs;
  }

  /** Moves on from where it is at -1..1 of full speed along each axis. */
  setVelocity(x: number, y: number, z: number, nowMs: number): void {
    this.value.set(this.valueAt(nowMs));
    this.durationMs = 0;
    const full = this.isHand ? MAX_HAND_SPEED : MAX_LEG_SPEED;
    this.velocity[0] = Math.min(Math.max(x, -1), 1) * full;
    this.velocity[1] = this.isHand ? Math.min(Math.max(y, -1), 1) * full : 0;
    this.velocity[2] = this.isHand ? Math.min(Math.max(z, -1), 1) * full : 0;
    this.inputAt = nowMs;
  }

  /** Brings the value to `nowMs`. */
  advance(nowMs: number): void {
    const seconds = Math.max(nowMs - this.movedAt, 0) / 1000;
    this.movedAt = Math.max(nowMs, this.movedAt);
    const { value, velocity } = this;
    if (!this.isKnown || (velocity[0] === 0 && velocity[1] === 0 && velocity[2] === 0)) return;
    this.set(value[0] + velocity[0] * seconds, value[1] + velocity[1] * seconds, value[2] + velocity[2] * seconds);
  }

  /** Where the limb should be at `nowMs` (3): on the way to what was asked for. The storage is used again by the next call. */
  valueAt(nowMs: number): Float64Array {
    this.advance(nowMs);
    const { interpolated: between, start, value, durationMs: way } = this;
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
    const scale = Math.min(1, MAX_TARGET_REACH / Math.hypot(x, y, z));
    value[0] = x * scale;
    value[1] = y * scale;
    value[2] = z * scale;
  }
}
