/**
 * Clock of the presented stage: the viewer's own time, or that of a leader (the audio) while there is one. Changes
 * between the two, and jumps of the leader, are slewed and never stepped. Times are microseconds.
 */

import { Slew } from "./slew";

/** Stage time of a leader, and the number of its current run; within a run the time does not jump. */
export interface LeaderTime {
  readonly time: number;
  readonly run: number;
}

/** Time constant of the slew: picture and sound are synchronous again within a quarter of a second. */
const SLEW_TIME_CONSTANT_US = 80e3;
/** Larger differences are stepped, since the two times belong to different parts of the motion. */
const RESET_THRESHOLD_US = 2e6;

/** Clock of the presented stage. */
export class PresentationClock {
  private readonly offset = new Slew(SLEW_TIME_CONSTANT_US);
  private run: number | null = null;
  private last: { time: number; local: number } | null = null;

  /** Return the presented time at `local`, where the viewer's own stage time is `ownTime`. */
  at(ownTime: number, leader: LeaderTime | null, local: number): number {
    const run = leader?.run ?? null;
    const time = leader?.time ?? ownTime;
    if (run !== this.run) {
      this.run = run;
      const difference = this.last ? this.last.time + (local - this.last.local) - time : 0;
      this.offset.start(Math.abs(difference) < RESET_THRESHOLD_US ? difference : 0, 0, local);
    }
    const presented = time + this.offset.at(local);
    if (!this.last || local >= this.last.local) this.last = { time: presented, local };
    return presented;
  }
}
