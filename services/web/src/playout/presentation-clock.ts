/**
 * The stage time that is shown: the viewer's own, or that of a leader (the sound) while there is one. From one to the other, and
 * where the leader jumps, it is slewed and never steps. Times are microseconds.
 */

import { Slew } from "./slew";

/** The stage time that a leader is at, and the number of the run in which it goes on without a jump. */
export interface LeaderTime {
  readonly time: number;
  readonly run: number;
}

/** Time constant, microseconds: what is seen is with what is heard again within a quarter of a second. */
const SLEW_TIME_CONSTANT_US = 80e3;
/** Further apart than this the two tell of different things, and nothing is gained by going over slowly. */
const RESET_THRESHOLD_US = 2e6;

export class PresentationClock {
  private readonly offset = new Slew(SLEW_TIME_CONSTANT_US);
  private run: number | null = null;
  private last: { time: number; local: number } | null = null;

  /** What is shown at `local`, where one's own stage time is `own` and the leader, if there is one, is at `lead`. */
  at(ownTime: number, leader: LeaderTime | null, local: number): number {
    const run = leader?.run ?? null;
    const time = leader?.time ?? ownTime;
    if (run !== this.run) {
      this.run = run;
      const away = this.last ? this.last.time + (local - this.last.local) - time : 0;
      this.offset.start(Math.abs(away) < RESET_THRESHOLD_US ? away : 0, 0, local);
    }
    const shown = time + this.offset.at(local);
    if (!this.last || local >= this.last.local) this.last = { time: shown, local };
    return shown;
  }
}
