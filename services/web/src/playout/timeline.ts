/**
 * Timeline of a stage: mapping of clock time to motion time (`proto/playback.md`, 4.2). Times are microseconds:
 * `clock` of the reference clock, positions and durations of the motion.
 */

import type { TimelineState } from "../wire/messages";

/** Return the motion time at `clock`, 0..duration; before the timeline begins, its first position. */
export function positionAt(state: TimelineState, clock: number): number {
  const position = state.position + (state.playing ? Math.max(clock - state.clock, 0) : 0);
  if (state.loop && state.duration > 0) return position % state.duration;
  return Math.min(position, state.duration);
}

/** Newest timeline, and the one before it, which applies until the newest begins. */
export class TimelineHistory {
  private previous: TimelineState | null = null;
  private latest: TimelineState | null = null;

  /** Timeline of the highest epoch. */
  get newest(): TimelineState | null {
    return this.latest;
  }

  /** Add a timeline. Return false, and ignore it, if its epoch is not newer. */
  put(state: TimelineState): boolean {
    if (this.latest !== null && state.epoch <= this.latest.epoch) return false;
    this.previous = this.latest;
    this.latest = state;
    return true;
  }

  /** Return the timeline that applies at `clock`, or null before the first `put`. */
  at(clock: number): TimelineState | null {
    const { previous, latest } = this;
    const isPending = latest !== null && clock < latest.clock;
    return isPending && previous !== null && previous.motion === latest.motion ? previous : latest;
  }

  /** Accept the first timeline of a new connection, whatever its epoch. */
  restart(): void {
    if (this.latest !== null) this.latest = { ...this.latest, epoch: -1 };
  }
}
