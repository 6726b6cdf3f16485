/** Sessions of `proto/vectors/bonded_stage.json`: two hands that are bonded, and the overlays that the session sends. */

import { createMarionetteSolver, type LimbSolver } from "../../src/client/marionette-solver";
import type { StagedFrame } from "../../src/client/performer-view";
import type { Placement } from "../../src/motion/placement";
import { fromRotationVector } from "../../src/motion/rotation";
import { copyPose, type Pose, restPose } from "../../src/motion/skeleton";
import { OverlayBuffer } from "../../src/playout/overlay-buffer";
import { unpackOverlay } from "../../src/wire/overlay";
import { decodeBase64, loadVectors } from "../golden-vectors";
import { figure, table } from "../marionette/figure";

type Numbers = [number, number, number];

/** Frame, puppeteer, action, limb, and its second argument. */
export type StageEvent = [number, string, string, number, (number | Numbers)?];

export interface StageCase {
  name: string;
  delay: number;
  performers: { placement: Numbers; root: Numbers; swing: Numbers[]; hertz: Numbers[]; phase: Numbers[] }[];
  events: StageEvent[];
  overlays: string[];
}

export const { interval_us, origin_us, cases } = loadVectors<{
  interval_us: number;
  origin_us: number;
  cases: StageCase[];
}>("bonded_stage");

export const FRAME_MS = interval_us / 1000;

/** Performers of a case, with the session's overlays. */
export class BondedStage {
  readonly overlays = new OverlayBuffer();
  readonly solvers: LimbSolver[];
  /** Poses of the current frame, with the overlays. */
  readonly poses: Pose[];
  private readonly motions: Pose[];

  constructor(readonly stage: StageCase) {
    this.solvers = stage.performers.map(() => createMarionetteSolver(figure, [table, table]));
    this.poses = stage.performers.map(restPose);
    this.motions = stage.performers.map(restPose);
  }

  /** Return the frames of all performers; those up to `received` overlays are shown. */
  frames(frame: number, nowMs: number, received = frame): StagedFrame[] {
    this.overlays.clear();
    const from = Math.max(received - 2, 0);
    for (const overlay of this.stage.overlays.slice(from, received + 1))
      this.overlays.put(unpackOverlay(decodeBase64(overlay)));
    const clock = origin_us + frame * interval_us;
    const frames: StagedFrame[] = this.stage.performers.map((performer, number) => {
      const motion = this.motions[number],
        pose = this.poses[number];
      const [x, z, turn] = performer.placement;
      const placement: Placement = { x, z, turn };
      motion.root.set(performer.root);
      const t = (frame * interval_us) / 1e6;
      performer.swing.forEach((swing, joint) => {
        const at = (axis: number) =>
          swing[axis] * Math.sin(2 * Math.PI * performer.hertz[joint][axis] * t + performer.phase[joint][axis]);
        fromRotationVector(motion.rotations, 4 * joint, at(0), at(1), at(2));
      });
      copyPose(motion, pose);
      const overlaidMask = this.overlays.apply(clock, pose, number);
      const solver = this.solvers[number];
      return { performer: number, pose, motion, overlaidMask, nowMs, solver, placement, partner: (n) => frames[n] };
    });
    return frames;
  }
}

/** Return the place (3) of a hand in a pose: its tip in the shoulder's frame, arm lengths. */
export function handPlace(limb: number, pose: Pose): Float64Array {
  const { limbs } = createMarionetteSolver(figure, [table, table]);
  const place = new Float64Array(3);
  limbs[limb & 3].placeInPose(place, pose.rotations);
  return place;
}
