/**
 * One limb in this puppeteer's own hands: where it should be, and how far it has left the dance. It mirrors what the session
 * does (`marionette/steering.py`, `handover.py`), so that the puppeteer sees at once what everyone will see shortly. Times
 * are local milliseconds and come in as arguments.
 */

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
export const THIGH: readonly [number, number] = [-Math.PI / 4, (2 * Math.PI) / 3];

const between = (value: number, least: number, most: number) => Math.min(Math.max(value, least), most);

/** 0 to 1 for x from 0 to 1, with no speed and no acceleration at either end (Flash and Hogan 1985). */
function minimumJerk(x: number): number {
  return x * x * x * (10 + x * (6 * x - 15));
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
    for (let axis = 0; axis < 3; axis++) dance[axis] += weight * (value[axis] - dance[axis]);
    solver.solve(pose, this.limb, dance, nowMs);
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
