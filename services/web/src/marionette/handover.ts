/**
 * Hand-over between the stored motion and a puppeteer, so that a limb never jumps. The target moves at a bounded
 * acceleration (`follower`), then the limb is solved; at the same time the joints are blended (`blend`) with the
 * weight computed here. Python: `marionette/handover.py`.
 */

import { conjugate, multiply, type Numbers, rotate } from "../motion/rotation";
import { dot, normalise, rotationBetween, setVector, unit } from "../motion/vector";
import {
  BLEND_IN_S,
  BLEND_OUT_S,
  MIN_HALF_ANGLE_COSINE,
  MIN_RETURN_ACCELERATION,
  RETURN_DURATION_S,
} from "./constants";

/**
 * Return the acceleration that brings a limb back in `RETURN_DURATION_S`. The limb is `distance` away and moves
 * away at `speed`; it brakes, accelerates and brakes again. The result is within `MIN_RETURN_ACCELERATION` and
 * `maxAcceleration`.
 */
export function returnAcceleration(distance: number, speed: number, maxAcceleration: number): number {
  let low = MIN_RETURN_ACCELERATION,
    high = maxAcceleration;
  for (let i = 0; i < 20; i++) {
    const middle = 0.5 * (low + high);
    const farthest = distance + (speed * speed) / (2 * middle);
    if (speed / middle + 2 * Math.sqrt(farthest / middle) > RETURN_DURATION_S) low = middle;
    else high = middle;
  }
  return high;
}

/** Ease x from 0 to 1 with zero speed and zero acceleration at both ends (Flash and Hogan 1985). */
export function minimumJerk(x: number): number {
  return x * x * x * (10 + x * (6 * x - 15));
}

/** Progress of a hand-over: 0 (stored motion) to 1 (puppeteer), linear in time. */
export class Handover {
  progress = 0;

  /** Weight of the solver's joints, 0..1. */
  get weight(): number {
    return minimumJerk(this.progress);
  }

  /** Advance by `seconds`, in the direction that depends on whether the limb is held. */
  advance(isHeld: boolean, seconds: number): void {
    const step = isHeld ? seconds / BLEND_IN_S : -seconds / BLEND_OUT_S;
    this.progress = Math.min(Math.max(this.progress + step, 0), 1);
  }
}

/**
 * Rotation from the direction of the motion's hand to that of the controlled hand. It has a state, so that it does
 * not change sides when the two pass opposite each other.
 */
export class DirectionAlignment {
  private readonly rotation = new Float64Array(4);
  private hasRotation = false;
  private readonly motionDirection = new Float64Array(3);
  private readonly controlledDirection = new Float64Array(3);
  private readonly onwards = new Float64Array(4);
  private readonly shortest = new Float64Array(4);

  /** Forget the state. */
  reset(): void {
    this.hasRotation = false;
  }

  /**
   * Write the rotation (4) from the direction of `motionTarget` (3) to that of `controlledTarget` (3). Its twist
   * about the arm, relative to the shortest rotation, is at most half a turn times `weight`. At `weight` 1 the
   * state is reset.
   */
  update(out: Numbers, outAt: number, motionTarget: Numbers, controlledTarget: Numbers, weight: number): void {
    const { rotation: turn, motionDirection, controlledDirection, onwards, shortest } = this;
    if (!unit(motionDirection, 0, motionTarget, 0)) setVector(motionDirection, 0, 0, -1, 0);
    if (!unit(controlledDirection, 0, controlledTarget, 0)) setVector(controlledDirection, 0, 0, -1, 0);
    rotationBetween(shortest, 0, motionDirection, 0, controlledDirection, 0);
    if (this.hasRotation) {
      rotate(motionDirection, 0, turn, 0, motionDirection, 0);
      rotationBetween(onwards, 0, motionDirection, 0, controlledDirection, 0);
      multiply(turn, 0, onwards, 0, turn, 0);
      conjugate(onwards, 0, shortest, 0);
      multiply(onwards, 0, turn, 0, onwards, 0);
      const fullTurn = 2 * Math.PI,
        maxTwist = Math.PI * weight;
      let twist = 2 * Math.atan2(dot(onwards, 1, controlledDirection, 0), onwards[0]);
      twist -= fullTurn * Math.round(twist / fullTurn);
      if (Math.abs(twist) > maxTwist) {
        const sine = Math.sin(0.5 * Math.min(Math.max(twist, -maxTwist), maxTwist));
        onwards[0] = Math.sqrt(1 - sine * sine);
        for (let i = 0; i < 3; i++) onwards[i + 1] = controlledDirection[i] * sine;
        multiply(turn, 0, onwards, 0, shortest, 0);
      }
      normalise(turn, 0);
    } else {
      turn.set(shortest);
    }
    this.hasRotation = weight < 1;
    for (let i = 0; i < 4; i++) out[outAt + i] = turn[i];
  }
}

/**
 * Blend of a limb's joints between the motion and the solver. Each joint keeps its way round unless it becomes
 * much longer: with the shortest way, a joint would be thrown across when the two rotations become opposite.
 */
export class JointBlend {
  private readonly previousRotations = new Float64Array(12);
  private readonly way = new Float64Array(4);
  private hasPreviousRotations = false;

  /** Forget the state. */
  reset(): void {
    this.hasPreviousRotations = false;
  }

  /** Write the joints (12) at `weight`: exactly the motion's at 0 and the solver's at 1, which resets the state. */
  blend(
    out: Numbers,
    outAt: number,
    motionJoints: Numbers,
    motionJointsAt: number,
    solvedJoints: Numbers,
    solvedJointsAt: number,
    weight: number,
  ): void {
    if (weight >= 1) {
      this.hasPreviousRotations = false;
      for (let i = 0; i < 12; i++) out[outAt + i] = solvedJoints[solvedJointsAt + i];
      return;
    }
    const { previousRotations: ways, way } = this;
    for (let at = 0; at < 12; at += 4) {
      conjugate(way, 0, motionJoints, motionJointsAt + at);
      multiply(way, 0, way, 0, solvedJoints, solvedJointsAt + at);
      let onwards = way[0];
      if (this.hasPreviousRotations) onwards = way.reduce((sum, part, i) => sum + part * ways[at + i], 0);
      let sign = onwards < 0 ? -1 : 1;
      if (sign * way[0] < MIN_HALF_ANGLE_COSINE) sign = -sign;
      for (let i = 0; i < 4; i++) ways[at + i] = way[i] *= sign;
      const sine = Math.hypot(way[1], way[2], way[3]),
        half = Math.atan2(sine, way[0]) * weight;
      const scale = sine > 1e-12 ? Math.sin(half) / sine : 0;
      way[0] = Math.cos(half);
      for (let i = 1; i < 4; i++) way[i] *= scale;
      if (weight <= 0) {
        for (let i = 0; i < 4; i++) out[outAt + at + i] = motionJoints[motionJointsAt + at + i];
        continue;
      }
      multiply(out, outAt + at, motionJoints, motionJointsAt + at, way, 0);
      normalise(out, outAt + at);
    }
    this.hasPreviousRotations = true;
  }
}
