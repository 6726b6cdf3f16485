/**
 * Target of a limb, computed from this page's inputs.
 *
 * The value is a hand target (arm lengths, in the shoulder's frame) or a thigh angle (radians, the first of three). A
 * target input is approached linearly, in the time between the last two inputs, so that a stream of inputs moves evenly
 * and not in steps. A velocity input moves the value until the next input. The session computes the same
 * (`marionette/limb_target.py`). Times are local milliseconds.
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

/** Maximum distance of a hand target from the shoulder, arm lengths. */
export const MAX_TARGET_REACH = 1;
/** Range of thigh angles, radians forwards from straight down. */
export const THIGH_RANGE: readonly [number, number] = [MIN_THIGH_ANGLE_RAD, MAX_THIGH_ANGLE_RAD];
/** Maximum time to approach a target. */
const MAX_TARGET_DURATION_MS = MAX_TARGET_DURATION_US / 1000;

/** Time without an input after which the target of a bonded hand follows the pair. */
export const FOLLOW_DELAY_MS = 1_000;

/** Target of one limb. */
export class LimbTarget {
  /** True from the claim to the release. */
  isHeld = false;
  /** Requested value (3), as sent to the session; undefined until `isKnown`. */
  readonly value = new Float64Array(3);
  /** True once there is a value: the position of the limb at its first frame, or the first target. */
  isKnown = false;
  /** True if the value has followed the pair since the last input: the session may have another one. */
  hasFollowed = false;

  private readonly velocity = new Float64Array(3);
  private movedAt = 0;
  // approach to the last target: from `start` at `inputAt`, in `durationMs`
  private readonly start = new Float64Array(3);
  private inputAt = 0;
  private durationMs = 0;
  private readonly interpolated = new Float64Array(3);

  constructor(readonly limb: number) {}

  private get isHand(): boolean {
    return limbWithinPerformer(this.limb) < 2;
  }

  /** Hold the limb at its current position until the first input. */
  claim(nowMs: number): void {
    if (this.isHeld) return;
    this.isHeld = true;
    this.isKnown = false;
    this.velocity.fill(0);
    this.durationMs = 0;
    this.movedAt = this.inputAt = nowMs;
  }

  /** Release the limb. */
  release(): void {
    this.velocity.fill(0);
    this.isHeld = false;
  }

  /** Set the position of the limb at the claim, unless there is a value already. */
  setStart(position: Float64Array, nowMs: number): void {
    if (this.isKnown) return;
    this.set(position[0], position[1], position[2]);
    this.isKnown = true;
    this.movedAt = nowMs;
  }

  /**
   * Set the value of a bonded hand to its shown place, where the next movement starts, unless there was an input just
   * now. The session does the same with a puppeteer who does not move the pair.
   */
  follow(place: Float64Array, nowMs: number): void {
    const isMoving = this.velocity.some((part) => part !== 0);
    if (isMoving || nowMs - this.inputAt < FOLLOW_DELAY_MS) return;
    this.set(place[0], place[1], place[2]);
    this.durationMs = 0;
    this.isKnown = this.hasFollowed = true;
  }

  /** Return the time since the last input, or the claim, in seconds; 0 while an input moves the value. */
  inputAgeS(nowMs: number): number {
    return this.velocity.some((part) => part !== 0) ? 0 : Math.max(nowMs - this.inputAt, 0) / 1000;
  }

  /** Set the target; one out of reach is clamped. */
  setTarget(x: number, y: number, z: number, nowMs: number): void {
    this.start.set(this.valueAt(nowMs));
    this.durationMs = this.isKnown ? Math.min(nowMs - this.inputAt, MAX_TARGET_DURATION_MS) : 0;
    this.set(x, y, z);
    this.isKnown = true;
    this.velocity.fill(0);
    this.inputAt = nowMs;
  }

  /** Move from the current value at -1..1 of full speed along each axis. */
  setVelocity(x: number, y: number, z: number, nowMs: number): void {
    this.value.set(this.valueAt(nowMs));
    this.durationMs = 0;
    const maxSpeed = this.isHand ? MAX_HAND_SPEED : MAX_LEG_SPEED;
    this.velocity[0] = Math.min(Math.max(x, -1), 1) * maxSpeed;
    this.velocity[1] = this.isHand ? Math.min(Math.max(y, -1), 1) * maxSpeed : 0;
    this.velocity[2] = this.isHand ? Math.min(Math.max(z, -1), 1) * maxSpeed : 0;
    this.inputAt = nowMs;
  }

  /** Advance the value to `nowMs`. */
  advance(nowMs: number): void {
    const seconds = Math.max(nowMs - this.movedAt, 0) / 1000;
    this.movedAt = Math.max(nowMs, this.movedAt);
    const { value, velocity } = this;
    if (!this.isKnown || (velocity[0] === 0 && velocity[1] === 0 && velocity[2] === 0)) return;
    this.set(value[0] + velocity[0] * seconds, value[1] + velocity[1] * seconds, value[2] + velocity[2] * seconds);
  }

  /** Return the target (3) at `nowMs`, on the approach to the requested value. The next call reuses the storage. */
  valueAt(nowMs: number): Float64Array {
    this.advance(nowMs);
    const { interpolated, start, value, durationMs } = this;
    const share = durationMs > 0 ? Math.min(Math.max(nowMs - this.inputAt, 0) / durationMs, 1) : 1;
    for (let i = 0; i < 3; i++) interpolated[i] = share < 1 ? start[i] + share * (value[i] - start[i]) : value[i];
    return interpolated;
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
