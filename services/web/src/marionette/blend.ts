/**
 * Blend of an arm between the stored motion's joints and the solver's. Both are expressed in the frame of their
 * chord, the segment from shoulder to tip with the plane of the elbow, where they differ little. The arm is then
 * closed on the target again, so that the tip is exact throughout. The remaining jumps affect only the swivel of
 * the elbow and the twist of the bones, and both change at a bounded speed. Python: `marionette/blend.py`.
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

/** Blend of one arm, with the state of the swivel and of the twist. */
export class ArmBlend {
  private swivelRad: number | null = null;
  /** Decaying offset about the chord that hides a change of the way round. */
  private swivelOffsetRad = 0;
  private readonly twistLimiter: TwistLimiter;
  private readonly motionTip = new Float64Array(3);
  private readonly direction = new Float64Array(3);
  private readonly ownNormal = new Float64Array(3);
  private readonly carried = new Float64Array(3);
  private readonly side = new Float64Array(3);
  private readonly rest = new Float64Array(3);
  private readonly elbowPoint = new Float64Array(3);
  private readonly goal = new Float64Array(3);
  private readonly frame = new Float64Array(4);
  private readonly turn = new Float64Array(4);
  private readonly before = new Float64Array(4);

  constructor(private readonly rig: ArmRig) {
    this.twistLimiter = new TwistLimiter(rig.bones);
  }

  /** Forget the state. */
  reset(): void {
    this.swivelRad = null;
    this.swivelOffsetRad = 0;
    this.twistLimiter.reset();
  }

  /**
   * Write the joints (12) at `weight`, `seconds` after the last call: 0 gives the motion's joints and 1 the
   * solver's in the plane of `normal`, once no bone's twist lags.
   *
   * `solvedJoints` (12) are those of `ArmRig.bendJoints` for the `target` (3, arm lengths, axes of vl5).
   * `alignment` (4) rotates the direction of the motion's hand to the target's; `normal` (3) is a unit vector
   * perpendicular to the target. In between, the elbow is at the nearest position from which forearm and hand
   * reach the target.
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
    const { rig, motionTip, direction, frame, carried } = this;
    rig.targetDirection(direction, 0, target, 0);
    rig.tipTarget(motionTip, 0, motionJoints, motionJointsAt);
    // offset and lag vanish with the weight, so that the release of the limb is no jump
    const share = Math.min(Math.max(Math.cbrt(weight), DISTANCE_WEIGHT * distanceBetween(target, 0, motionTip, 0)), 1);
    const maxOffset = Math.min(Math.abs(this.swivelOffsetRad), FULL_TURN_RAD * share);
    this.swivelOffsetRad = Math.sign(this.swivelOffsetRad) * Math.max(maxOffset - MAX_TWIST_SPEED_RAD_S * seconds, 0);
    if (weight >= 1) {
      this.swivelRad = null;
      fromAxisAngle(frame, 0, direction, 0, this.swivelOffsetRad);
      rotate(carried, 0, frame, 0, normal, 0);
      rig.chordFrame(frame, 0, direction, this.swivelOffsetRad === 0 ? normal : carried);
      multiply(out, outAt, frame, 0, solvedJoints, 0);
      normalise(out, outAt);
      for (let i = 4; i < 12; i++) out[outAt + i] = solvedJoints[i];
    } else {
      rig.targetDirection(motionTip, 0, motionTip, 0);
      this.blendJoints(out, outAt, motionJoints, motionJointsAt, solvedJoints, target, alignment, normal, weight);
    }
    this.twistLimiter.limit(out, outAt, share, seconds);
  }

  /** Write the joints (12) below weight 1; `direction` and `motionTip` hold the directions of target and motion. */
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
    const { rig, direction, motionTip, ownNormal, carried, side, frame } = this;
    rig.planeNormal(ownNormal, 0, motionJoints, motionJointsAt);
    rejectFrom(ownNormal, 0, ownNormal, 0, motionTip, 0);
    if (!unit(ownNormal, 0, ownNormal, 0)) anyPerpendicular(ownNormal, 0, motionTip, 0);
    rotate(carried, 0, alignment, 0, ownNormal, 0);
    cross(side, 0, carried, 0, normal, 0);
    let swivel = Math.atan2(dot(side, 0, direction, 0), dot(carried, 0, normal, 0));
    if (this.swivelRad !== null) {
      const onwards = swivel + FULL_TURN_RAD * Math.round((this.swivelRad - swivel) / FULL_TURN_RAD);
      if (weight > SWIVEL_RESET_WEIGHT && Math.abs(onwards) <= MAX_TWIST_LAG_RAD) swivel = onwards;
      else {
        // the other way round from now on: the offset keeps the shown elbow in place and decays
        this.swivelOffsetRad += weight * (onwards - swivel);
        this.swivelOffsetRad -= FULL_TURN_RAD * Math.round(this.swivelOffsetRad / FULL_TURN_RAD);
      }
    }
    this.swivelRad = swivel;
    if (weight <= 0) {
      for (let i = 0; i < 12; i++) out[outAt + i] = motionJoints[motionJointsAt + i];
      return;
    }
    rig.chordFrame(frame, 0, motionTip, ownNormal);
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

  /** Rotate shoulder and elbow least so that the tip is at `reach` arm lengths along the chord. */
  private closeOnTip(joints: Numbers, at: number, reach: number): void {
    const { rig, rest, elbowPoint, goal, turn, before, side: blendedElbow } = this;
    const { bones: links } = rig;
    rotate(rest, 0, joints, at + 8, links, 6);
    addScaled(rest, 0, links, 3, rest, 0, 1);
    const near = length(links, 0),
      far = length(rest, 0);
    const chord = Math.max(reach * rig.armLengthM, 1e-9);
    const along = Math.min(Math.max((near * near + chord * chord - far * far) / (2 * chord), -near), near);
    const off = Math.sqrt(Math.max(near * near - along * along, 0));
    rotate(blendedElbow, 0, joints, at, links, 0);
    // an elbow that must move away from the chord moves towards -y, where the elbow of the bent arm is
    setVector(
      elbowPoint,
      0,
      0,
      blendedElbow[1] - Math.max(off - Math.hypot(blendedElbow[1], blendedElbow[2]), 0),
      blendedElbow[2],
    );
    if (!unit(elbowPoint, 0, elbowPoint, 0)) setVector(elbowPoint, 0, 0, -1, 0);
    setVector(elbowPoint, 0, along, off * elbowPoint[1], off * elbowPoint[2]);
    multiply(before, 0, joints, at, joints, at + 4);
    setVector(goal, 0, elbowPoint[0] / near, elbowPoint[1] / near, elbowPoint[2] / near);
    for (let i = 0; i < 3; i++) blendedElbow[i] /= near;
    rotationBetween(turn, 0, blendedElbow, 0, goal, 0);
    multiply(joints, at, turn, 0, joints, at);
    // the part below the elbow: its direction now, and the required one
    rotate(rest, 0, before, 0, rest, 0);
    if (!unit(rest, 0, rest, 0)) setVector(rest, 0, 1, 0, 0);
    setVector(goal, 0, chord - elbowPoint[0], -elbowPoint[1], -elbowPoint[2]);
    if (!unit(goal, 0, goal, 0)) setVector(goal, 0, 1, 0, 0);
    rotationBetween(turn, 0, rest, 0, goal, 0);
    multiply(before, 0, turn, 0, before, 0);
    conjugate(turn, 0, joints, at);
    multiply(joints, at + 4, turn, 0, before, 0);
    normalise(joints, at + 4);
  }
}
