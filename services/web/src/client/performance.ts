/** One performer of a motion as a viewer shows it: its dance, what is pulled laid over it, and where it stands on the stage. */

import { bring, type PerformerTrack, type Place } from "../motion/performer";
import { copyPose, type Figure, type Pose, restPose } from "../motion/skeleton";
import type { BlockStore } from "../playout/blocks";
import type { Overlays } from "../playout/overlay";
import type { OwnSolver } from "./own-solver";
import type { Puppeteer } from "./puppeteer";

export class Performance implements PerformerTrack {
  /** Whether anything of it could be shown yet. */
  shown = false;
  private readonly danced = restPose();
  private readonly merged = restPose();

  /**
   * @param number of the performer
   * @param store keeps the blocks of its dance
   * @param own what one's own limbs of it are solved with
   */
  constructor(private readonly number: number, readonly store: BlockStore, private readonly own: OwnSolver) {}

  get figure(): Figure {
    return this.store.track.figure;
  }

  get front(): number {
    return this.store.track.front + this.place.turn;
  }

  get place(): Place {
    return this.store.track.place;
  }

  /** Makes what one's own limbs are solved with, unless it is there. */
  prepare(): void {
    this.own.prepare();
  }

  /**
   * The dance goes to `position` of a motion of `duration`, microseconds; false, and it holds still, where the block needed is
   * missing.
   */
  dance(position: number, loop: boolean, duration: number): boolean {
    if (!this.store.poseAt(position, loop, this.danced, duration)) return false;
    if (!this.shown) this.prepare();
    return (this.shown = true);
  }

  /**
   * The pose to draw at `clock`, local `nowMs`: the dance where it is, with what is pulled laid over it, and one's own limbs as
   * one pulls them, all of it in its place. Null before there is any. The storage is used again by the next call.
   */
  pose(clock: number, overlays: Overlays, puppeteer: Puppeteer | null, nowMs: number): Pose | null {
    if (!this.shown) return null;
    const { danced, merged, number, own } = this;
    copyPose(danced, merged);
    const laid = overlays.lay(clock, merged, number);
    if (own.solver) puppeteer?.lay(merged, danced, laid, nowMs, own.solver, number);
    return bring(merged, this.place);
  }
}
