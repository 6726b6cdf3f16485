/**
 * Between the dance and a puppeteer's hand: what keeps a limb from jumping when it is taken and let go. The *place* of the limb
 * goes over at a bounded acceleration (`follow`), then the limb is solved; over the same time the joints are brought from the
 * dance's way of reaching a place to the marionette's (`blend`), by the weight given here. As `marionette/handover.py`.
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
 * What brings a limb back in `RETURN` that is `distance` away and goes away at `speed`, by braking, speeding up and braking
 * again; within `LEAST_ACCELERATION` and `most`.
 */
export function returnAcceleration(distance: number, speed: number, maxAcceleration: number): number {
  let low = MIN_RETURN_ACCELERATION,
    high = maxAcceleration;
  for (let i = 0; i < 20; i++) {
    const middle = 0.5 * (low + high);
    const turned = distance + (speed * speed) / (2 * middle);
    if (speed / middle + 2 * Math.sqrt(turned / middle) > RETURN_DURATION_S) low = middle;
    else high = middle;
  }
  return high;
}

/** 0 to 1 for x from 0 to 1, with no speed and no acceleration at either end (Flash and Hogan 1985). */
export function minimumJerk(x: number): number {
  return x * x * x * (10 + x * (6 * x - 15));
}

/** How far a limb is in its puppeteer's hands: `progress` 0 (the dance's) to 1, even in time. */
export class Handover {
  progress = 0;

  /** Of the marionette's way of holding the limb, 0..1. */
  get weight(): number {
    return minimumJerk(this.progress);
  }

  /** `seconds` later, with the limb held or not. */
  advance(isHeld: boolean, seconds: number): void {
    const step = isHeld ? seconds / BLEND_IN_S : -seconds / BLEND_OUT_S;
    this.progress = Math.min(Math.max(this.progress + step, 0), 1);
  }
}

/**
 * The turn that brings the direction of the dance's hand to that of the pulled one, on a way round the shoulder. It is carried
 * on from call to call, so that two hands that pass opposite each other do not make it change sides.
 */
export class DirectionAlignment {
  private readonly rotation = new Float64Array(4);
  private hasRotation = false;
  private readonly here = new Float64Array(3);
  private readonly there = new Float64Array(3);
  private readonly onwards = new Float64Array(4);
  private readonly shortest = new Float64Array(4);

  /** Forgets the way it went. */
  reset(): void {
    this.hasRotation = false;
  }

  /**
   * The turn (4) from the direction of `dance` (3) to that of `pulled` (3). What it turns about the arm itself, having gone
   * round, is at most half a circle times `weight`: so it is the shortest turn when the hand is back. All the way there, at
   * `weight` 1, it starts afresh from the shortest.
   */
  update(out: Numbers, outAt: number, motionTarget: Numbers, controlledTarget: Numbers, weight: number): void {
    const { rotation: turn, here, there, onwards, shortest } = this;
    if (!unit(here, 0, motionTarget, 0)) setVector(here, 0, 0, -1, 0);
    if (!unit(there, 0, controlledTarget, 0)) setVector(there, 0, 0, -1, 0);
    rotationBetween(shortest, 0, here, 0, there, 0);
    if (this.hasRotation) {
      rotate(here, 0, turn, 0, here, 0);
      rotationBetween(onwards, 0, here, 0, there, 0);
      multiply(turn, 0, onwards, 0, turn, 0);
      conjugate(onwards, 0, shortest, 0);
      multiply(onwards, 0, turn, 0, onwards, 0);
      const whole = 2 * Math.PI,
        most = Math.PI * weight;
      let twist = 2 * Math.atan2(dot(onwards, 1, there, 0), onwards[0]);
      twist -= whole * Math.round(twist / whole);
      if (Math.abs(twist) > most) {
        const sine = Math.sin(0.5 * Math.min(Math.max(twist, -most), most));
        onwards[0] = Math.sqrt(1 - sine * sine);
        for (let i = 0; i < 3; i++) onwards[i + 1] = there[i] * sine;
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
 * The joints of a limb between the dance's and the marionette's. Each turns on the way that it took first, as long as that is
 * not much the longer: by the shortest way it would be thrown across when the two come to be opposite each other.
 */
export class JointBlend {
  private readonly previousRotations = new Float64Array(12);
  private readonly way = new Float64Array(4);
  private hasPreviousRotations = false;

  /** Forgets the ways that were taken. */
  reset(): void {
    this.hasPreviousRotations = false;
  }

  /** The joints (12) at `weight`; exactly either at 0 and 1, and all the way there it starts afresh. */
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
