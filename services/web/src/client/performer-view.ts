/** One performer of a motion as a viewer shows it: its dance, what is pulled laid over it, and where it stands on the stage. */

import { applyPlacement, type Placement, type StagedPerformer } from "../motion/placement";
import { copyPose, type Figure, type Pose, restPose } from "../motion/skeleton";
import type { MotionBlockStore } from "../playout/block-store";
import type { OverlayBuffer } from "../playout/overlay-buffer";
import type { Puppeteer } from "./puppeteer";
import type { SolverLoader } from "./solver-loader";

export class PerformerView implements StagedPerformer {
  /** Whether anything of it could be shown yet. */
  hasPose = false;
  private readonly motionPose = restPose();
  private readonly mergedPose = restPose();

  /**
   * @param number of the performer
   * @param store keeps the blocks of its dance
   * @param solverLoader what one's own limbs of it are solved with
   */
  constructor(
    private readonly number: number,
    readonly store: MotionBlockStore,
    private readonly solverLoader: SolverLoader,
  ) {}

  get figure(): Figure {
    return this.store.track.figure;
  }

  get front(): number {
    return this.store.track.front + this.placement.turn;
  }

  get placement(): Placement {
    return this.store.track.placement;
  }

  /** Makes what one's own limbs are solved with, unless it is there. */
  loadSolver(): void {
    this.solverLoader.load();
  }

  /**
   * The dance goes to `position` of a motion of `duration`, microseconds; false, and it holds still, where the block needed is
   * missing.
   */
  seek(position: number, loop: boolean, duration: number): boolean {
    if (!this.store.poseAt(position, loop, this.motionPose, duration)) return false;
    if (!this.hasPose) this.loadSolver();
    return (this.hasPose = true);
  }

  /**
   * The pose to draw at `clock`, local `nowMs`: the dance where it is, with what is pulled laid over it, and one's own limbs as
   * one pulls them, all of it in its place. Null before there is any. The storage is used again by the next call.
   */
  pose(clock: number, overlays: OverlayBuffer, puppeteer: Puppeteer | null, nowMs: number): Pose | null {
    if (!this.hasPose) return null;
    const { motionPose: danced, mergedPose: merged, number, solverLoader: own } = this;
    copyPose(danced, merged);
    const laid = overlays.apply(clock, merged, number);
    if (own.solver) puppeteer?.applyOwnLimbs(merged, danced, laid, nowMs, own.solver, number);
    return applyPlacement(merged, this.placement);
  }
}
