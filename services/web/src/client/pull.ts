/**
 * One limb in this puppeteer's own hands: where it should be, and how far it has left the dance. It mirrors what the session
 * does (`marionette/steering.py`, `handover.py`), so that the puppeteer sees at once what everyone will see shortly. Times
 * are local milliseconds and come in as arguments.
 */

import { THIGH_GREATEST, THIGH_LEAST } from "../marionette/leg";
import type { Pose } from "../motion/skeleton";
import type { Solver } from "./solver";

/** Milliseconds from the dance to the hand, and back. */
const TAKE = 150;
const GIVE_BACK = 300;

/** Full speed of a hand, arm lengths a second along each axis. */
export const HAND_SPEED = 1;
/** Full speed of a leg, radians a second. */
export const LEG_SPEED = 2;
/** How far a hand is pulled from its shoulder, arm lengths. */
export const REACH = 1;
/** The angles a thigh is pulled to, radians forwards from straight down. */
export const THIGH: readonly [number, number] = [THIGH_LEAST, THIGH_GREATEST];

const between = (value: number, least: number, most: number) => Math.min(Math.max(value, least), most);

/** 0 to 1 for x from 0 to 1, with no speed and no acceleration at either end (Flash and Hogan 1985). */
function minimumJerk(x: number): number {
  return x * x * x * (10 + x * (6 * x - 15));
}

/** Brings the hand at `from` on to `to` by `weight`, round the shoulder and not through it. */
function goRound(from: Float64Array, to: Float64Array, weight: number): void {
  const near = Math.hypot(from[0], from[1], from[2]), far = Math.hypot(to[0], to[1], to[2]);
  // a hand at the shoulder itself is below it
  const at = (v: Float64Array, length: number, axis: number) => (length > 1e-9 ? v[axis] / length : axis === 1 ? -1 : 0);
  const x = at(from, near, 0), y = at(from, near, 1), z = at(from, near, 2);
  const dot = x * at(to, far, 0) + y * at(to, far, 1) + z * at(to, far, 2);
  let p = at(to, far, 0) - dot * x, q = at(to, far, 1) - dot * y, r = at(to, far, 2) - dot * z;
  const square = Math.hypot(p, q, r), angle = Math.atan2(square, dot) * weight;
  if (square > 1e-9) [p, q, r] = [p / square, q / square, r / square];
  // straight across, any way round is as near: by the front, or the side for a hand before or behind
  else if (Math.abs(z) < 0.9) [p, q, r] = unitSquare(0, 0, 1, x, y, z);
  else [p, q, r] = unitSquare(1, 0, 0, x, y, z);
  const length = near + weight * (far - near), c = length * Math.cos(angle), s = length * Math.sin(angle);
  from[0] = c * x + s * p;
  from[1] = c * y + s * q;
  from[2] = c * z + s * r;
}

/** The unit vector nearest to (a, b, c) square to the unit (x, y, z). */
function unitSquare(a: number, b: number, c: number, x: number, y: number, z: number): [number, number, number] {
  const dot = a * x + b * y + c * z;
  const length = Math.hypot(a - dot * x, b - dot * y, c - dot * z);
  return [(a - dot * x) / length, (b - dot * y) / length, (c - dot * z) / length];
}

export class Pull {
  /** Whether the limb is, or is being, held. */
  held = false;
  /** Where it should be (3); means nothing until `placed`. */
  readonly value = new Float64Array(3);
  /** Whether the value is known: it starts where the limb is when it is first drawn, or at the first target. */
  placed = false;

  private readonly velocity = new Float64Array(3);
  private movedAt = 0;
  private progress = 0;
  private drawnAt: number | null = null;
  private readonly dance = new Float64Array(3);

  constructor(readonly limb: number) {}

  private get isHand(): boolean {
    return this.limb < 2;
  }

  /** Takes the limb; it stays where it is until it is told otherwise. */
  take(nowMs: number): void {
    if (this.held) return;
    this.held = true;
    this.velocity.fill(0);
    this.movedAt = nowMs;
  }

  /** Lets the limb go: it returns to what everyone sees. */
  letGo(nowMs: number): void {
    this.move(nowMs);
    this.velocity.fill(0);
    this.held = false;
    if (this.progress === 0) this.placed = false;
  }

  /** Asks for a place; one out of reach is brought in. */
  target(x: number, y: number, z: number, nowMs: number): void {
    this.set(x, y, z);
    this.placed = true;
    this.velocity.fill(0);
    this.movedAt = nowMs;
  }

  /** Moves on from where it is at -1..1 of full speed along each axis. */
  speed(x: number, y: number, z: number, nowMs: number): void {
    this.move(nowMs);
    const full = this.isHand ? HAND_SPEED : LEG_SPEED;
    this.velocity[0] = between(x, -1, 1) * full;
    this.velocity[1] = this.isHand ? between(y, -1, 1) * full : 0;
    this.velocity[2] = this.isHand ? between(z, -1, 1) * full : 0;
  }

  /** Brings the value to `nowMs`. */
  move(nowMs: number): void {
    const seconds = Math.max(nowMs - this.movedAt, 0) / 1000;
    this.movedAt = Math.max(nowMs, this.movedAt);
    const { value, velocity } = this;
    if (!this.placed || (velocity[0] === 0 && velocity[1] === 0 && velocity[2] === 0)) return;
    this.set(value[0] + velocity[0] * seconds, value[1] + velocity[1] * seconds, value[2] + velocity[2] * seconds);
  }

  /**
   * Lays the limb over `pose`, which shows what everyone sees: the target goes over from there to the hand's and back, then the
   * limb is solved. False where the limb is wholly the others'.
   */
  lay(pose: Pose, nowMs: number, solver: Solver): boolean {
    const passed = this.drawnAt === null ? 0 : Math.max(nowMs - this.drawnAt, 0);
    this.drawnAt = nowMs;
    if (!this.held && this.progress === 0) return false;
    this.progress = between(this.progress + (this.held ? passed / TAKE : -passed / GIVE_BACK), 0, 1);
    if (this.progress === 0 && !this.held) {
      this.placed = false;
      solver.rest(this.limb);
      return false;
    }
    const { value, dance } = this;
    solver.target(pose, this.limb, dance);
    if (!this.placed) {
      this.set(dance[0], dance[1], dance[2]);
      this.placed = true;
      this.movedAt = nowMs;
    }
    this.move(nowMs);
    // the first moment of a hold is the dance's still: it is not solved, so that nothing jumps
    if (this.progress === 0) return false;
    const weight = minimumJerk(this.progress);
    if (this.isHand) goRound(dance, value, weight);
    else dance[0] += weight * (value[0] - dance[0]);
    solver.solve(pose, this.limb, dance, weight, nowMs);
    return true;
  }

  private set(x: number, y: number, z: number): void {
    const { value } = this;
    if (!this.isHand) {
      value[0] = between(x, THIGH[0], THIGH[1]);
      return;
    }
    const scale = Math.min(1, REACH / Math.hypot(x, y, z));
    value[0] = x * scale;
    value[1] = y * scale;
    value[2] = z * scale;
  }
}
