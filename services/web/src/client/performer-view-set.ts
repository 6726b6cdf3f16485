/** The performers of the motion that is watched, and how the first's dance comes on: by that a line is judged. */

import type { Figure, Pose } from "../motion/skeleton";
import { OverlayBuffer } from "../playout/overlay-buffer";
import { positionAt } from "../playout/timeline";
import type { TrackSet } from "../playout/track-set";
import type { TimelineState } from "../wire/messages";
import { PerformerView } from "./performer-view";
import type { Puppeteer } from "./puppeteer";
import type { SolverLoader } from "./solver-loader";

export class PerformerViewSet {
  /** By number; null one whose track cannot be read. */
  all: (PerformerView | null)[] = [];
  readonly overlays = new OverlayBuffer();
  /** Of the first: when it was first to be seen (local milliseconds), the rate of the block on show (-1 before there is one), how often one was missing. */
  firstPoseMs: number | null = null;
  level = -1;
  gaps = 0;
  private missingBlock = -1;

  /** @param createLoader makes what one's own limbs of a figure are solved with */
  constructor(private readonly createLoader: (figure: Figure) => SolverLoader) {}

  /** Whether anything of the first could be shown yet. */
  get hasPose(): boolean {
    return this.all[0]?.hasPose ?? false;
  }

  /** Whether the first holds still, as the block needed is missing. */
  get isStalled(): boolean {
    return this.missingBlock >= 0;
  }

  /** Another motion comes on. */
  reset(tracks: TrackSet): void {
    this.overlays.clear();
    this.missingBlock = this.level = -1;
    this.all = [];
    this.add(tracks);
  }

  /** Those who were not known before come on. */
  add({ performers }: TrackSet): void {
    for (let number = this.all.length; number < performers.length; number++) {
      const store = performers[number];
      this.all.push(store && new PerformerView(number, store, this.createLoader(store.track.figure)));
    }
  }

  /** Makes what is missing of what one's own limbs of those who were seen are solved with. */
  loadSolvers(): void {
    for (const one of this.all) if (one?.hasPose) one.loadSolver();
  }

  /** The pose of a performer to draw at `clock` of its motion's `timeline`, local `nowMs`: see `Viewer.poseAt`. */
  poseAt(
    performer: number,
    clock: number,
    timeline: TimelineState,
    puppeteer: Puppeteer | null,
    nowMs: number,
  ): Pose | null {
    const one = this.all[performer];
    if (!one) return null;
    const position = positionAt(timeline, clock);
    const here = one.seek(position, timeline.loop, timeline.duration);
    if (performer === 0) this.updateStatistics(one, here, position, timeline.playing, nowMs);
    return one.pose(clock, this.overlays, puppeteer, nowMs);
  }

  /** The first was to go to `position`: it did, or it holds still. */
  private updateStatistics(
    { store, hasPose: shown }: PerformerView,
    hasBlock: boolean,
    position: number,
    playing: boolean,
    nowMs: number,
  ): void {
    const index = store.track.blockAt(position);
    if (hasBlock) {
      this.firstPoseMs ??= nowMs;
      this.missingBlock = -1;
      this.level = store.levels[index];
    } else if (playing && shown && this.missingBlock !== index) {
      this.missingBlock = index;
      this.gaps++;
    }
  }
}
