/** Work per frame on the threads of a page, from Chromium's trace. */

/** An event of the trace. Times are in microseconds; `tdur` is the thread's processor time. */
export interface TraceEvent {
  name: string;
  pid: number;
  tid: number;
  ts: number;
  dur?: number;
  tdur?: number;
}

/** Marks of `performance.mark`: an animation frame of the page, and a frame that the engine has drawn. */
export const FRAME_MARK = "frame";
export const DRAWN_MARK = "drawn";

/** Trace categories of callbacks and marks, and of tasks. */
export const TRACE_CATEGORIES = ["devtools.timeline", "blink.user_timing"];
export const TASK_CATEGORY = "disabled-by-default-devtools.timeline";

/** Events of the page's own work, callbacks and messages, and of all tasks, layout and painting included. */
export const CALLBACK_EVENTS = ["FireAnimationFrame", "HandlePostMessage"];
export const TASK_EVENTS = ["RunTask"];

/** Durations in milliseconds: processor time and wall clock time of each animation frame callback that drew. */
export interface DrawnFrames {
  callbackCount: number;
  work: number[];
  wall: number[];
}

/** Return the animation frame callbacks that drew, on the thread of the engine. */
export function findDrawnFrames(events: readonly TraceEvent[]): DrawnFrames {
  const thread = threadOfMark(events, DRAWN_MARK);
  const marks = thread.filter(({ name }) => name === DRAWN_MARK).map(({ ts }) => ts);
  const callbacks = thread.filter((event) => event.name === "FireAnimationFrame" && isComplete(event));
  const drew = callbacks.filter(({ ts, dur = 0 }) => marks.some((at) => at >= ts && at <= ts + dur));
  return {
    callbackCount: callbacks.length,
    work: drew.map(({ tdur = 0 }) => tdur / 1000),
    wall: drew.map(({ dur = 0 }) => dur / 1000),
  };
}

/**
 * Return the processor time in milliseconds of the page's main thread from each animation frame to the next: all events
 * with these names that end between the two marks. The task of a frame ends after its mark.
 */
export function sumMainThreadWork(events: readonly TraceEvent[], names: readonly string[]): number[] {
  const thread = threadOfMark(events, FRAME_MARK);
  const marks = thread.filter(({ name }) => name === FRAME_MARK).map(({ ts }) => ts);
  const work = Array<number>(Math.max(0, marks.length - 1)).fill(0);
  for (const { name, ts, dur = 0, tdur = 0 } of thread) {
    const frame = names.includes(name) ? marks.findLastIndex((at) => at <= ts + dur) : -1;
    if (frame >= 0 && frame < work.length) work[frame] += tdur / 1000;
  }
  return work;
}

function threadOfMark(events: readonly TraceEvent[], mark: string): TraceEvent[] {
  const found = events.find(({ name }) => name === mark);
  if (!found) throw new Error(`The trace has no mark "${mark}"`);
  return events.filter(({ pid, tid }) => pid === found.pid && tid === found.tid).sort((a, b) => a.ts - b.ts);
}

function isComplete({ dur, tdur }: TraceEvent): boolean {
  return dur !== undefined && tdur !== undefined;
}
