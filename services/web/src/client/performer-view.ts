/** One performer as a viewer shows it: motion or live poses, overlays, and placement on the stage. */

import { applyPlacement, type Placement, type StagedPerformer } from "../motion/placement";
import { copyPose, type Figure, type Pose, restPose } from "../motion/skeleton";
import type { MotionBlockStore } from "../playout/block-store";
import type { LivePoses } from "../playout/live-poses";
import type { OverlayBuffer } from "../playout/overlay-buffer";
import type { PredictionFrame } from "./predicted-limb";
import type { SolverLoader } from "./solver-loader";

/** Frame of one performer among those of the others, whose hands may be bonded to it. */
export interface StagedFrame extends PredictionFrame {
  readonly placement: Placement;
  /** Return the frame of another performer at the same instant, null if it cannot be predicted. */
  partner(performer: number): StagedFrame | null;
}

/** Source of predictions for the limbs that this page controls: a puppeteer. */
export interface LimbPredictor {
  /** Apply the predictions to the frame's pose. Return the mask of the performer's limbs that are predicted. */
  applyOwnLimbs(frame: StagedFrame): number;
}

/** Instant and live inputs of a drawn frame. */
export interface FrameContext {
  /** Presented reference time, microseconds. */
  readonly clock: number;
  /** Local time, milliseconds. */
  readonly nowMs: number;
  readonly overlays: OverlayBuffer;
  readonly predictor: LimbPredictor | null;
  /** Return another performer's view, moved to this instant; null if there is none. */
  partner(performer: number): PerformerView | null;
}

/** One performer of a motion. */
export class PerformerView implements StagedPerformer {
  /** True once there was a pose to show. */
  hasPose = false;
  /** Mask of the limbs that are controlled in the last pose, by overlays or predictions; bit 0 is the first limb. */
  controlledLimbs = 0;
  private readonly motionPose = restPose();
  private readonly mergedPose = restPose();
  /** Pose for the predictions of another performer. */
  private partnerPose: Pose | null = null;

  /**
   * @param number number of the performer
   * @param store blocks of its motion
   * @param solverLoader loader of the solver that predicts this page's limbs
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

  /** Load the solver, unless it is loaded. */
  loadSolver(): void {
    this.solverLoader.load();
  }

  /** Move to the live pose at presented clock time `clock`. Return false if there is none. */
  seekLive(live: LivePoses, clock: number): boolean {
    if (!live.poseAt(this.number, clock, this.motionPose)) return false;
    if (!this.hasPose) this.loadSolver();
    return (this.hasPose = true);
  }

  /**
   * Move to `position` of a motion of `duration` (microseconds). Return false, and keep the last pose, if the block is
   * missing.
   */
  seek(position: number, loop: boolean, duration: number): boolean {
    if (!this.store.poseAt(position, loop, this.motionPose, duration)) return false;
    if (!this.hasPose) this.loadSolver();
    return (this.hasPose = true);
  }

  /**
   * Return the pose at the current position with overlays and predicted limbs, placed on the stage; null before the
   * first pose. The next call reuses the storage.
   */
  pose(context: FrameContext): Pose | null {
    if (!this.hasPose) return null;
    const { mergedPose: pose } = this;
    const overlaidMask = this.mergeOverlays(pose, context);
    const frame = this.predictionFrame(pose, overlaidMask, context);
    this.controlledLimbs = overlaidMask | ((frame && context.predictor?.applyOwnLimbs(frame)) ?? 0);
    return applyPlacement(pose, this.placement);
  }

  /** Return the frame at the current position without predictions, null without a pose or a solver. */
  partnerFrame(context: FrameContext): StagedFrame | null {
    if (!this.hasPose) return null;
    this.partnerPose ??= restPose();
    return this.predictionFrame(this.partnerPose, this.mergeOverlays(this.partnerPose, context), context);
  }

  /** Write the motion's pose with the overlays; return the mask of the limbs that they replace. */
  private mergeOverlays(pose: Pose, { clock, overlays }: FrameContext): number {
    copyPose(this.motionPose, pose);
    return overlays.apply(clock, pose, this.number);
  }

  private predictionFrame(pose: Pose, overlaidMask: number, context: FrameContext): StagedFrame | null {
    const { motionPose: motion, number: performer, placement } = this;
    const { solver } = this.solverLoader;
    const partner = (other: number) => context.partner(other)?.partnerFrame(context) ?? null;
    return solver && { performer, pose, motion, overlaidMask, nowMs: context.nowMs, solver, placement, partner };
  }
}
