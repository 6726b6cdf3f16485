/** Mapping of an interval of clock time to spans of motion time, in each of which the motion does not jump. */

import { positionAt, type TimelineHistory } from "./timeline";

/** Interval of clock time in which the motion plays from `position`, or stands still there; microseconds. */
export interface TimelineSpan {
  readonly start: number;
  readonly end: number;
  readonly position: number;
  readonly isMoving: boolean;
}

/**
 * Return the spans of the clock times `from`..`to`, in order and without gaps. A span ends where a known timeline takes
 * effect, where a loop restarts, and where the motion ends. The result is empty before the first timeline.
 */
export function spansBetween(timelines: TimelineHistory, from: number, to: number): TimelineSpan[] {
  const spans: TimelineSpan[] = [];
  const newest = timelines.newest;
  for (let at = from; at < to; ) {
    const state = timelines.at(at);
    if (!state || !newest) break;
    const position = positionAt(state, at);
    const remaining = state.duration - position;
    const isMoving = state.playing && at >= state.clock && remaining > 0;
    let end = to;
    for (const start of [state.clock, newest.clock]) if (at < start) end = Math.min(end, start);
    // a span is at least one microsecond long: smaller steps are lost in the precision of clock times
    if (isMoving) end = Math.min(end, Math.max(at + remaining, at + 1));
    spans.push({ start: at, end, position, isMoving });
    at = end;
  }
  return spans;
}
