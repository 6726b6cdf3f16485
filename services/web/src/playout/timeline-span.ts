/** What a stretch of clock time is in the motion: a span for each piece in which it goes on without a jump. */

import { positionAt, type TimelineHistory } from "./timeline";

/** From clock time `from` up to `to` the motion goes on from `position`, or stands still there. Microseconds. */
export interface TimelineSpan {
  readonly start: number;
  readonly end: number;
  readonly position: number;
  readonly isMoving: boolean;
}

/**
 * The spans of clock times `from`..`to`, in order and without gaps: cut where a timeline that is known already takes effect,
 * where a loop begins anew, and where the motion ends. None before there is a timeline.
 */
export function spansBetween(timelines: TimelineHistory, from: number, to: number): TimelineSpan[] {
  const spans: TimelineSpan[] = [];
  const newest = timelines.newest;
  for (let at = from; at < to; ) {
    const state = timelines.at(at);
    if (!state || !newest) break;
    const position = positionAt(state, at);
    const left = state.duration - position;
    const moving = state.playing && at >= state.clock && left > 0;
    let end = to;
    for (const begin of [state.clock, newest.clock]) if (at < begin) end = Math.min(end, begin);
    // a step of a microsecond at least: finer ones are lost in numbers as large as clock times
    if (moving) end = Math.min(end, Math.max(at + left, at + 1));
    spans.push({ start: at, end: end, position, isMoving: moving });
    at = end;
  }
  return spans;
}
