/** The performers of the motion that is watched, and how the first's dance comes on: by that a line is judged. */

import type { Figure, Pose } from "../motion/skeleton";
import { Overlays } from "../playout/overlay";
import { positionAt } from "../playout/timeline";
import type { Tracks } from "../playout/tracks";
import type { TimelineState } from "../wire/messages";
import type { OwnSolver } from "./own-solver";
import { Performance } from "./performance";
import type { Puppeteer } from "./puppeteer";

export class Performances {
  /** By number; null one whose track cannot be read. */
  all: (Performance | null)[] = [];
  readonly overlays = new Overlays();
  /** Of the first: when it was first to be seen (local milliseconds), the rate of the block on show (-1 before there is one), how often one was missing. */
  firstPoseMs: number | null = null;
  rate = -1;
  gaps = 0;
  private missing = -1;

  /** @param solver makes what one's own limbs of a figure are solved with */
  constructor(private readonly solver: (figure: Figure) => OwnSolver) {}

  /** Whether anything of the first could be shown yet. */
  get shown(): boolean {
    return this.all[0]?.shown ?? false;
  }

  /** Whether the first holds still, as the block needed is missing. */
  get waiting(): boolean {
    return this.missing >= 0;
  }

  /** Another motion comes on. */
  begin(tracks: Tracks): void {
    this.overlays.clear();
    this.missing = this.rate = -1;
    this.all = [];
    this.add(tracks);
  }

  /** Those who were not known before come on. */
  add({ performers }: Tracks): void {
    for (let number = this.all.length; number < performers.length; number++) {
      const store = performers[number];
      this.all.push(store && new Performance(number, store, this.solver(store.track.figure)));
    }
  }

  /** Makes what is missing of what one's own limbs of those who were seen are solved with. */
  prepare(): void {
    for (const one of this.all) if (one?.shown) one.prepare();
  }

  /** The pose of a performer to draw at `clock` of its motion's `timeline`, local `nowMs`: see `Viewer.poseAt`. */
  poseAt(performer: number, clock: number, timeline: TimelineState, puppeteer: Puppeteer | null, nowMs: number): Pose | null {
    const one = this.all[performer];
    if (!one) return null;
    const position = positionAt(timeline, clock);
    const here = one.dance(position, timeline.loop, timeline.duration);
    if (performer === 0) this.danced(one, here, position, timeline.playing, nowMs);
    return one.pose(clock, this.overlays, puppeteer, nowMs);
  }

  /** The first was to go to `position`: it did, or it holds still. */
  private danced({ store, shown }: Performance, here: boolean, position: number, playing: boolean, nowMs: number): void {
    const index = store.track.blockAt(position);
    if (here) {
      this.firstPoseMs ??= nowMs;
      this.missing = -1;
      this.rate = store.rates[index];
    } else if (playing && shown && this.missing !== index) {
      this.missing = index;
      this.gaps++;
    }
  }
}
