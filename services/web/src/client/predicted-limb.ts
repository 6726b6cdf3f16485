/**
 * One limb in this puppeteer's own hands, as this puppeteer sees it: moved at once, as the session will move it for everyone.
 * Once it is back in the dance it is what everyone sees again, and so it is while the session has it in another's hands. Between
 * the two nothing jumps (`marionette/correction`). Times are local milliseconds.
 */

import type { ControlledLimb } from "../marionette/controlled-limb";
import { Correction } from "../marionette/correction";
import { Handover } from "../marionette/handover";
import { LIMB_FIRST_JOINTS, type Pose } from "../motion/skeleton";
import { limbWithinPerformer } from "../wire/limbs";
import { LimbTarget } from "./limb-target";
import type { LimbSolver } from "./solver";

/** After a longer pause between two frames the limb moves as if only this had passed, seconds. */
const MAX_STEP_S = 0.1;
/**
 * A limb let go comes home here before it does for everyone. For so many seconds the dance is shown of it until the others' has
 * come too, and not once more its way home.
 */
const MAX_RETURN_S = 1;

export class PredictedLimb {
  readonly target: LimbTarget;
  private readonly handover = new Handover();
  private readonly correction = new Correction();
  private readonly joints = new Float64Array(12);
  private readonly offset: number;
  private drawnAt: number | null = null;
  private controlled: ControlledLimb | null = null;
  /** Whether it has left the dance, and whether it is shown as it is here (else as everyone sees it). */
  private hasLeftMotion = false;
  private isPredicted = false;
  /** Seconds since it came back. */
  private sinceReturn = 0;

  constructor(readonly limb: number) {
    this.target = new LimbTarget(limb);
    this.offset = 4 * LIMB_FIRST_JOINTS[limbWithinPerformer(limb)];
  }

  /**
   * Lays the limb over `pose` of its performer, which shows what everyone sees, where it is this puppeteer's. `dance` is the dance alone, `laid`
   * says whether `pose` has the limb pulled, `theirs` whether the session has it in another's hands.
   */
  apply(
    pose: Pose,
    motion: Pose,
    isOverlaid: boolean,
    isHeldByOther: boolean,
    nowMs: number,
    solver: LimbSolver,
  ): void {
    const { target: pull, handover, correction, joints, offset: at } = this;
    const seconds = this.drawnAt === null ? 0 : Math.min(Math.max(nowMs - this.drawnAt, 0) / 1000, MAX_STEP_S);
    this.drawnAt = nowMs;
    const puppet = solver.limbs[limbWithinPerformer(this.limb)];
    if (puppet !== this.controlled) {
      // another dancer: a limb that is held goes on in it, from where the dance has it
      this.controlled = puppet;
      this.isPredicted = false;
    }
    handover.advance(pull.isHeld && !isHeldByOther, seconds);
    puppet.observePose(motion.rotations, seconds);
    if (pull.isHeld && !isHeldByOther && !this.hasLeftMotion) {
      this.hasLeftMotion = true;
      // on its way home from other hands, or from these: it starts where everyone sees it
      if (isOverlaid && !this.isPredicted) puppet.startFrom(pose.rotations);
    }
    this.step(motion, nowMs, seconds);
    const own =
      !isHeldByOther && (this.hasLeftMotion || (this.isPredicted && isOverlaid && this.sinceReturn < MAX_RETURN_S));
    correction.advance(seconds);
    if (own && !this.isPredicted) correction.begin(pose.rotations, at, joints, 0);
    if (!own && this.isPredicted) correction.begin(joints, 0, pose.rotations, at);
    this.isPredicted = own;
    if (own) pose.rotations.set(joints, at);
    correction.apply(pose.rotations, at);
    if (isHeldByOther && this.hasLeftMotion) {
      this.hasLeftMotion = false;
      puppet.reset();
    }
  }

  /** Moves the limb on by `seconds`: `joints` are where it is here. */
  private step(dance: Pose, nowMs: number, seconds: number): void {
    const { target: pull, joints, offset: at } = this;
    const puppet = this.controlled!;
    if (this.hasLeftMotion) {
      if (pull.isHeld) pull.setStart(puppet.position, nowMs);
      const wanted = pull.isHeld ? pull.valueAt(nowMs) : null;
      if (puppet.solveJoints(joints, 0, dance.rotations, wanted, this.handover.weight, seconds)) return;
      puppet.reset();
      this.hasLeftMotion = false;
      this.sinceReturn = 0;
      // the hand is back, but the arm may still be turned about the line to it
      this.correction.begin(joints, 0, dance.rotations, at);
    }
    this.sinceReturn += seconds;
    joints.set(dance.rotations.subarray(at, at + 12));
  }
}
