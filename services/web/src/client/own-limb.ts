/**
 * One limb in this puppeteer's own hands, as this puppeteer sees it: moved at once, as the session will move it for everyone.
 * Once it is back in the dance it is what everyone sees again, and so it is while the session has it in another's hands. Between
 * the two nothing jumps (`marionette/correction`). Times are local milliseconds.
 */

import { Correction } from "../marionette/correction";
import { Handover } from "../marionette/handover";
import type { Pulled } from "../marionette/pulled";
import { LIMB_JOINTS, type Pose } from "../motion/skeleton";
import { limbOf } from "../wire/limbs";
import { Pull } from "./pull";
import type { Solver } from "./solver";

/** After a longer pause between two frames the limb moves as if only this had passed, seconds. */
const LONGEST_STEP = 0.1;
/**
 * A limb let go comes home here before it does for everyone. For so many seconds the dance is shown of it until the others' has
 * come too, and not once more its way home.
 */
const LONGEST_TAIL = 1;

export class OwnLimb {
  readonly pull: Pull;
  private readonly handover = new Handover();
  private readonly correction = new Correction();
  private readonly joints = new Float64Array(12);
  private readonly at: number;
  private drawnAt: number | null = null;
  private puppet: Pulled | null = null;
  /** Whether it has left the dance, and whether it is shown as it is here (else as everyone sees it). */
  private out = false;
  private own = false;
  /** Seconds since it came back. */
  private home = 0;

  constructor(readonly limb: number) {
    this.pull = new Pull(limb);
    this.at = 4 * LIMB_JOINTS[limbOf(limb)];
  }

  /**
   * Lays the limb over `pose` of its performer, which shows what everyone sees, where it is this puppeteer's. `dance` is the dance alone, `laid`
   * says whether `pose` has the limb pulled, `theirs` whether the session has it in another's hands.
   */
  lay(pose: Pose, dance: Pose, laid: boolean, theirs: boolean, nowMs: number, solver: Solver): void {
    const { pull, handover, correction, joints, at } = this;
    const seconds = this.drawnAt === null ? 0 : Math.min(Math.max(nowMs - this.drawnAt, 0) / 1000, LONGEST_STEP);
    this.drawnAt = nowMs;
    const puppet = solver.limbs[limbOf(this.limb)];
    if (puppet !== this.puppet) {
      // another dancer: a limb that is held goes on in it, from where the dance has it
      this.puppet = puppet;
      this.own = false;
    }
    handover.advance(pull.held && !theirs, seconds);
    puppet.see(dance.rotations, seconds);
    if (pull.held && !theirs && !this.out) {
      this.out = true;
      // on its way home from other hands, or from these: it starts where everyone sees it
      if (laid && !this.own) puppet.startFrom(pose.rotations);
    }
    this.step(dance, nowMs, seconds);
    const own = !theirs && (this.out || (this.own && laid && this.home < LONGEST_TAIL));
    correction.advance(seconds);
    if (own && !this.own) correction.begin(pose.rotations, at, joints, 0);
    if (!own && this.own) correction.begin(joints, 0, pose.rotations, at);
    this.own = own;
    if (own) pose.rotations.set(joints, at);
    correction.lay(pose.rotations, at);
    if (theirs && this.out) {
      this.out = false;
      puppet.rest();
    }
  }

  /** Moves the limb on by `seconds`: `joints` are where it is here. */
  private step(dance: Pose, nowMs: number, seconds: number): void {
    const { pull, joints, at } = this;
    const puppet = this.puppet!;
    if (this.out) {
      if (pull.held) pull.begin(puppet.place, nowMs);
      const wanted = pull.held ? pull.wanted(nowMs) : null;
      if (puppet.pull(joints, 0, dance.rotations, wanted, this.handover.weight, seconds)) return;
      puppet.rest();
      this.out = false;
      this.home = 0;
      // the hand is back, but the arm may still be turned about the line to it
      this.correction.begin(joints, 0, dance.rotations, at);
    }
    this.home += seconds;
    joints.set(dance.rotations.subarray(at, at + 12));
  }
}
