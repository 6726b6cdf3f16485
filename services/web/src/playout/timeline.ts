/**
 * Where in the motion the stage stands at a clock time (`proto/SPEC.md`, Timeline). Times are microseconds: `clock` on the
 * reference clock, positions in the motion.
 */

import type { TimelineState } from "../wire/messages";

/** The motion time at `clock`, 0..duration; before the timeline begins, where it begins. */
export function positionAt(state: TimelineState, clock: number): number {
  const position = state.position + (state.playing ? Math.max(clock - state.clock, 0) : 0);
  if (state.loop && state.duration > 0) return position % state.duration;
  return Math.min(position, state.duration);
}

/** The timeline that holds at a clock time: the newest, or while that lies ahead the one before it. */
export class TimelineHistory {
  private previous: TimelineState | null = null;
  private latest: TimelineState | null = null;

  /** The timeline of the highest epoch. */
  get newest(): TimelineState | null {
    return this.latest;
  }

  /** Takes in a timeline; false where one of this epoch or a newer one is here already. */
  put(state: TimelineState): boolean {
    if (this.latest !== null && state.epoch <= this.latest.epoch) return false;
    this.previous = this.latest;
    this.latest = state;
    return true;
  }

  /** The timeline that holds at `clock`, null where none was put yet. */
  at(clock: number): TimelineState | null {
    const { previous: before, latest } = this;
    if (latest !== null && before !== null && clock < latest.clock && before.motion === latest.motion) return before;
    return latest;
  }

  /** Forgets the epochs: a new connection counts its own. What holds now holds until its first timeline comes. */
  restart(): void {
    if (this.latest !== null) this.latest = { ...this.latest, epoch: -1 };
  }
}
