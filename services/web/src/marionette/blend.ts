/**
 * An arm between the dance's way of reaching its hand tip and the marionette's. Both arms are seen in the frame of their chord,
 * the line from shoulder to tip with the plane of the elbow about it. There they differ by little, and mixing their joints moves
 * the tip by little; the arm is then closed on the target again, so that the tip is exact all the way. What is left of jumps turns
 * nothing but the elbow about the chord, or links about themselves, and is gone through at a bounded speed. As
 * `marionette/blend.py`.
 */

import { conjugate, multiply, type Numbers, rotate, slerp } from "../motion/rotation";
import {
  addScaled,
  anyPerpendicular,
  cross,
  distanceBetween,
  dot,
  fromAxisAngle,
  length,
  normalise,
  rejectFrom,
  rotationBetween,
  setVector,
  unit,
} from "../motion/vector";
import { DISTANCE_WEIGHT, MAX_TWIST_LAG_RAD, MAX_TWIST_SPEED_RAD_S, SWIVEL_RESET_WEIGHT } from "./constants";
import type { ArmRig } from "./limb-rig";
import { FULL_TURN_RAD, TwistLimiter } from "./twist";

/** One arm on its way. It remembers which way round the elbow swings, and how far its links are turned. */
export class ArmBlend {
  private swivelRad: number | null = null;
  /** Radians about the chord that the elbow is shown ahead of its way, and goes back. */
  private swivelOffsetRad = 0;
  private readonly twistLimiter: TwistLimiter;
  private readonly own = new Float64Array(3);
  private readonly direction = new Float64Array(3);
  private readonly ownNormal = new Float64Array(3);
  private readonly carried = new Float64Array(3);
  private readonly side = new Float64Array(3);
  private readonly rest = new Float64Array(3);
  private readonly place = new Float64Array(3);
  private readonly goal = new Float64Array(3);
  private readonly frame = new Float64Array(4);
  private readonly turn = new Float64Array(4);
  private readonly before = new Float64Array(4);

  constructor(private readonly rig: ArmRig) {
    this.twistLimiter = new TwistLimiter(rig.bones);
  }

  /** Forgets the way it went. */
  reset(): void {
    this.swivelRad = null;
    this.swivelOffsetRad = 0;
    this.twistLimiter.reset();
  }

  /**
   * The joints (12) at `weight`, `seconds` after the last: 0 gives back the dance's, 1 the bent arm's in the plane of `normal`,
   * both as soon as the links have come round.
   *
   * `dance` (12 at `danceAt`) are the pose's joints, `bent` (12) those of `ArmRig.bend` for the `target` (3, arm lengths, axes of
   * vl5); `turn` (4) brings the direction of the dance's own hand to the target's, and `normal` is a unit vector (3) square to
   * that. Between, the elbow goes to the nearest place from which forearm and hand reach the target; where the mixed wrist
   * leaves none, the tip comes as near as it can.
   */
  blend(
    out: Numbers,
    outAt: number,
    motionJoints: Numbers,
    motionJointsAt: number,
    solvedJoints: Numbers,
    target: Numbers,
    alignment: Numbers,
    normal: Numbers,
    weight: number,
    seconds: number,
  ): void {
    const { rig, own, direction, frame, carried } = this;
    rig.targetDirection(direction, 0, target, 0);
    rig.tipTarget(own, 0, motionJoints, motionJointsAt);
    // nothing is left of the memory when the limb is the dance's again, so that it is let go without a jump
    const share = Math.min(Math.max(Math.cbrt(weight), DISTANCE_WEIGHT * distanceBetween(target, 0, own, 0)), 1);
    const most = Math.min(Math.abs(this.swivelOffsetRad), FULL_TURN_RAD * share);
    this.swivelOffsetRad = Math.sign(this.swivelOffsetRad) * Math.max(most - MAX_TWIST_SPEED_RAD_S * seconds, 0);
    if (weight >= 1) {
      this.swivelRad = null;
      fromAxisAngle(frame, 0, direction, 0, this.swivelOffsetRad);
      rotate(carried, 0, frame, 0, normal, 0);
      rig.chordFrame(frame, 0, direction, this.swivelOffsetRad === 0 ? normal : carried);
      multiply(out, outAt, frame, 0, solvedJoints, 0);
      normalise(out, outAt);
      for (let i = 4; i < 12; i++) out[outAt + i] = solvedJoints[i];
    } else {
      rig.targetDirection(own, 0, own, 0);
      this.blendJoints(out, outAt, motionJoints, motionJointsAt, solvedJoints, target, alignment, normal, weight);
    }
    this.twistLimiter.limit(out, outAt, share, seconds);
  }

  /** The joints (12) below weight 1, the directions of the target and of the dance's own hand being known. */
  private blendJoints(
    out: Numbers,
    outAt: number,
    motionJoints: Numbers,
    motionJointsAt: number,
    solvedJoints: Numbers,
    target: Numbers,
    alignment: Numbers,
    normal: Numbers,
    weight: number,
  ): void {
    const { rig, direction, own, ownNormal, carried, side, frame } = this;
    rig.planeNormal(ownNormal, 0, motionJoints, motionJointsAt);
    rejectFrom(ownNormal, 0, ownNormal, 0, own, 0);
    if (!unit(ownNormal, 0, ownNormal, 0)) anyPerpendicular(ownNormal, 0, own, 0);
    rotate(carried, 0, alignment, 0, ownNormal, 0);
    cross(side, 0, carried, 0, normal, 0);
    let swivel = Math.atan2(dot(side, 0, direction, 0), dot(carried, 0, normal, 0));
    if (this.swivelRad !== null) {
      const onwards = swivel + FULL_TURN_RAD * Math.round((this.swivelRad - swivel) / FULL_TURN_RAD);
      if (weight > SWIVEL_RESET_WEIGHT && Math.abs(onwards) <= MAX_TWIST_LAG_RAD) swivel = onwards;
      else {
        // the other way round from here on; it is shown where it was, and comes over
        this.swivelOffsetRad += weight * (onwards - swivel);
        this.swivelOffsetRad -= FULL_TURN_RAD * Math.round(this.swivelOffsetRad / FULL_TURN_RAD);
      }
    }
    this.swivelRad = swivel;
    if (weight <= 0) {
      for (let i = 0; i < 12; i++) out[outAt + i] = motionJoints[motionJointsAt + i];
      return;
    }
    rig.chordFrame(frame, 0, own, ownNormal);
    conjugate(frame, 0, frame, 0);
    multiply(out, outAt, frame, 0, motionJoints, motionJointsAt);
    for (let i = 4; i < 12; i++) out[outAt + i] = motionJoints[motionJointsAt + i];
    for (let i = 0; i < 12; i += 4) {
      slerp(out, outAt + i, out, outAt + i, solvedJoints, i, weight);
      normalise(out, outAt + i);
    }
    this.closeOnTip(out, outAt, length(target, 0));
    fromAxisAngle(frame, 0, direction, 0, swivel * weight + this.swivelOffsetRad);
    rotate(carried, 0, frame, 0, carried, 0);
    rig.chordFrame(frame, 0, direction, carried);
    multiply(out, outAt, frame, 0, out, outAt);
    normalise(out, outAt);
  }

  /** Turns shoulder and elbow by as little as brings the tip to `reach` arm lengths along the chord. */
  private closeOnTip(joints: Numbers, at: number, reach: number): void {
    const { rig, rest, place, goal, turn, before, side: mixed } = this;
    const { bones: links } = rig;
    rotate(rest, 0, joints, at + 8, links, 6);
    addScaled(rest, 0, links, 3, rest, 0, 1);
    const near = length(links, 0),
      far = length(rest, 0);
    const chord = Math.max(reach * rig.armLengthM, 1e-9);
    const along = Math.min(Math.max((near * near + chord * chord - far * far) / (2 * chord), -near), near);
    const off = Math.sqrt(Math.max(near * near - along * along, 0));
    rotate(mixed, 0, joints, at, links, 0);
    // where the elbow has to go farther off the chord, it goes to the side of -y: a straight arm leaves open which, and that of
    // the bent arm is there
    setVector(place, 0, 0, mixed[1] - Math.max(off - Math.hypot(mixed[1], mixed[2]), 0), mixed[2]);
    if (!unit(place, 0, place, 0)) setVector(place, 0, 0, -1, 0);
    setVector(place, 0, along, off * place[1], off * place[2]);
    multiply(before, 0, joints, at, joints, at + 4);
    setVector(goal, 0, place[0] / near, place[1] / near, place[2] / near);
    for (let i = 0; i < 3; i++) mixed[i] /= near;
    rotationBetween(turn, 0, mixed, 0, goal, 0);
    multiply(joints, at, turn, 0, joints, at);
    // what is below the elbow, as it lies and as it should
    rotate(rest, 0, before, 0, rest, 0);
    if (!unit(rest, 0, rest, 0)) setVector(rest, 0, 1, 0, 0);
    setVector(goal, 0, chord - place[0], -place[1], -place[2]);
    if (!unit(goal, 0, goal, 0)) setVector(goal, 0, 1, 0, 0);
    rotationBetween(turn, 0, rest, 0, goal, 0);
    multiply(before, 0, turn, 0, before, 0);
    conjugate(turn, 0, joints, at);
    multiply(joints, at + 4, turn, 0, before, 0);
    normalise(joints, at + 4);
  }
}
