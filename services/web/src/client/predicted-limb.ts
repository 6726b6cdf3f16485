/**
 * Prediction of one limb that this page controls: it moves at once, as the session will move it for all viewers.
 *
 * After its return to the motion, and while another puppeteer holds it, the limb is shown as the session sends it.
 * Transitions between the two are smooth (`marionette/correction`). A hand in a bond is where the prediction of the
 * bond has it (`predicted-bond`), whoever holds it. Times are local milliseconds.
 */

import type { ControlledHand, ControlledLimb } from "../marionette/controlled-limb";
import { Correction } from "../marionette/correction";
import { Handover } from "../marionette/handover";
import type { Point } from "../marionette/point";
import { LIMB_FIRST_JOINTS, type Pose } from "../motion/skeleton";
import { limbWithinPerformer } from "../wire/limbs";
import { LimbTarget } from "./limb-target";
import type { LimbSolver } from "./marionette-solver";

/** Maximum time step of the prediction, seconds: a longer pause between two frames counts as this. */
const MAX_STEP_S = 0.1;
/**
 * A released limb returns here before the session's overlays show its return. For this time the motion is shown, so
 * that the return is not seen twice; seconds.
 */
const MAX_RETURN_S = 1;

/** One frame of one performer, to which predictions are applied. */
export interface PredictionFrame {
  /** Number of the performer. */
  readonly performer: number;
  /** Pose with the session's overlays; it is modified. */
  readonly pose: Pose;
  /** Pose of the motion alone. */
  readonly motion: Pose;
  /** Mask of the performer's limbs that overlays replace; bit 0 is its first limb. */
  readonly overlaidMask: number;
  readonly nowMs: number;
  readonly solver: LimbSolver;
}

/** What a bond does to one limb: none; shown as the session sends it; or predicted at a place. */
export type BondedLimb = null | "shown" | Point;

/** Prediction of one limb. */
export class PredictedLimb {
  readonly target: LimbTarget;
  private readonly handover = new Handover();
  private readonly correction = new Correction();
  /** Predicted rotations of the limb's three joints. */
  private readonly joints = new Float64Array(12);
  private readonly shownPlace = new Float64Array(3);
  /** Number of the limb within its performer, and index of its first number in a pose. */
  private readonly localNumber: number;
  private readonly offset: number;
  private drawnAt: number | null = null;
  /** Seconds of the current frame, 0 once they are applied. */
  private frameS = 0;
  private controlled: ControlledLimb | null = null;
  /** True from the claim until the limb is back in the motion. */
  private hasLeftMotion = false;
  /** True if the prediction is shown, false if the session's pose is. */
  private isPredicted = false;
  /** Seconds since the return. */
  private sinceReturnS = 0;

  /** @param limb number of the limb among those of all performers */
  constructor(readonly limb: number) {
    this.target = new LimbTarget(limb);
    this.localNumber = limbWithinPerformer(limb);
    this.offset = 4 * LIMB_FIRST_JOINTS[this.localNumber];
  }

  /**
   * Observe the motion, once for each frame; `apply` must follow. Return the limb, and the seconds since the last
   * frame.
   */
  beginFrame({ motion, nowMs, solver }: PredictionFrame): { controlled: ControlledLimb; seconds: number } {
    const controlled = solver.limbs[this.localNumber];
    if (controlled !== this.controlled) {
      // the figure changed: a held limb continues from its position in the motion
      this.controlled = controlled;
      this.isPredicted = false;
    } else if (nowMs === this.drawnAt) return { controlled, seconds: this.frameS };
    this.frameS = this.drawnAt === null ? 0 : Math.min(Math.max(nowMs - this.drawnAt, 0) / 1000, MAX_STEP_S);
    this.drawnAt = nowMs;
    controlled.observePose(motion.rotations, this.frameS);
    return { controlled, seconds: this.frameS };
  }

  /** Start to control the limb, from where it is shown: after `beginFrame`. */
  leaveMotion(frame: PredictionFrame): void {
    if (this.hasLeftMotion) return;
    this.hasLeftMotion = true;
    // while an earlier control is still shown, start from the shown position
    if (this.isOverlaidIn(frame) && !this.isPredicted) this.controlled?.startFrom(frame.pose.rotations);
  }

  /** Return true if the session's overlays replace the limb in the frame. */
  isOverlaidIn({ overlaidMask }: PredictionFrame): boolean {
    return ((overlaidMask >> this.localNumber) & 1) !== 0;
  }

  /** Return the place of the limb (3) in the frame's pose, before the prediction is applied; live storage. */
  placeIn({ pose }: PredictionFrame): Float64Array {
    this.controlled?.placeInPose(this.shownPlace, pose.rotations);
    return this.shownPlace;
  }

  /**
   * Apply the prediction to the frame's pose, unless the limb is shown as the session sends it: while another puppeteer
   * holds it (`isHeldByOther`), or in a bond that is not predicted. Return whether the limb is predicted.
   */
  apply(frame: PredictionFrame, isHeldByOther: boolean, bonded: BondedLimb = null): boolean {
    const { pose, motion, nowMs } = frame;
    const { target, handover, correction, joints, offset } = this;
    const { controlled, seconds } = this.beginFrame(frame);
    this.frameS = 0;
    const isHeldHere = target.isHeld && !isHeldByOther;
    const isBonded = bonded !== null && bonded !== "shown";
    handover.advance(isHeldHere || isBonded, seconds);
    if (isHeldHere && bonded === "shown") target.follow(this.placeIn(frame), nowMs);
    else if (isHeldHere || isBonded) this.leaveMotion(frame);
    if (isBonded) {
      // only hands are bonded
      (controlled as ControlledHand).solveBondedJoints(joints, 0, motion.rotations, bonded, handover.weight, seconds);
    } else this.step(controlled, motion, nowMs, seconds);
    const isShown = bonded === "shown" || (isHeldByOther && !isBonded);
    const isPredicted =
      !isShown &&
      (this.hasLeftMotion || (this.isPredicted && this.isOverlaidIn(frame) && this.sinceReturnS < MAX_RETURN_S));
    correction.advance(seconds);
    if (isPredicted && !this.isPredicted) correction.begin(pose.rotations, offset, joints, 0);
    if (!isPredicted && this.isPredicted) correction.begin(joints, 0, pose.rotations, offset);
    this.isPredicted = isPredicted;
    if (isPredicted) pose.rotations.set(joints, offset);
    correction.apply(pose.rotations, offset);
    if (isShown && this.hasLeftMotion) {
      this.hasLeftMotion = false;
      controlled.reset();
    }
    return isPredicted;
  }

  /** Advance the prediction by `seconds` and write its `joints`. */
  private step(controlled: ControlledLimb, motion: Pose, nowMs: number, seconds: number): void {
    const { target, joints, offset } = this;
    if (this.hasLeftMotion) {
      if (target.isHeld) target.setStart(controlled.position, nowMs);
      const goal = target.isHeld ? target.valueAt(nowMs) : null;
      if (controlled.solveJoints(joints, 0, motion.rotations, goal, this.handover.weight, seconds)) return;
      controlled.reset();
      this.hasLeftMotion = false;
      this.sinceReturnS = 0;
      // the tip is back, but the limb may still be twisted about the axis to it
      this.correction.begin(joints, 0, motion.rotations, offset);
    }
    this.sinceReturnS += seconds;
    joints.set(motion.rotations.subarray(offset, offset + 12));
  }
}
