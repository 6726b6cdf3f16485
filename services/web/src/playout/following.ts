/**
 * The stage time that is shown: the viewer's own, or that of a leader (the sound) while there is one. From one to the other, and
 * where the leader jumps, it is slewed and never steps. Times are microseconds.
 */

import { Slew } from "./slew";

/** The stage time that a leader is at, and the number of the run in which it goes on without a jump. */
export interface Lead {
  readonly time: number;
  readonly run: number;
}

/** Time constant, microseconds: what is seen is with what is heard again within a quarter of a second. */
const QUICK = 80e3;
/** Further apart than this the two tell of different things, and nothing is gained by going over slowly. */
const ANOTHER = 2e6;

export class Following {
  private readonly rest = new Slew(QUICK);
  private run: number | null = null;
  private last: { time: number; local: number } | null = null;

  /** What is shown at `local`, where one's own stage time is `own` and the leader, if there is one, is at `lead`. */
  at(own: number, lead: Lead | null, local: number): number {
    const run = lead?.run ?? null;
    const time = lead?.time ?? own;
    if (run !== this.run) {
      this.run = run;
      const away = this.last ? this.last.time + (local - this.last.local) - time : 0;
      this.rest.start(Math.abs(away) < ANOTHER ? away : 0, 0, local);
    }
    const shown = time + this.rest.at(local);
    if (!this.last || local >= this.last.local) this.last = { time: shown, local };
    return shown;
  }
}
