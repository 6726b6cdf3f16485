import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import { positionAt, TimelineHistory } from "../../src/playout/timeline";
import { spansBetween } from "../../src/playout/timeline-span";
import type { TimelineState } from "../../src/wire/messages";

const UNIX = 1_774_000_000_000_000;

function state(change: Partial<TimelineState> = {}): TimelineState {
  return {
    name: "TimelineState",
    epoch: 1,
    motion: "dance",
    clock: UNIX,
    position: 0,
    playing: true,
    loop: true,
    duration: 2_600_000,
    ...change,
  };
}

function timelines(...states: TimelineState[]): TimelineHistory {
  const all = new TimelineHistory();
  for (const one of states) all.put(one);
  return all;
}

/** Spans told from `UNIX` on. */
function spans(all: TimelineHistory, from: number, to: number): unknown[] {
  return spansBetween(all, UNIX + from, UNIX + to).map((span) => [
    span.start - UNIX,
    span.end - UNIX,
    span.position,
    span.isMoving,
  ]);
}

test("before there is a timeline there is nothing", () => {
  expect(spansBetween(new TimelineHistory(), 0, 1e6)).toEqual([]);
});

describe("a stretch is", () => {
  test("one span where the motion goes on, stands, or waits to begin", () => {
    expect(spans(timelines(state()), 100_000, 200_000)).toEqual([[100_000, 200_000, 100_000, true]]);
    expect(spans(timelines(state({ playing: false, position: 7 })), 100_000, 200_000)).toEqual([
      [100_000, 200_000, 7, false],
    ]);
    expect(spans(timelines(state({ position: 7 })), -200_000, -100_000)).toEqual([[-200_000, -100_000, 7, false]]);
  });

  test("cut where it begins, where a loop begins anew and where the motion ends", () => {
    expect(spans(timelines(state({ position: 7 })), -100, 100)).toEqual([
      [-100, 0, 7, false],
      [0, 100, 7, true],
    ]);
    expect(spans(timelines(state()), 2_500_000, 2_700_000)).toEqual([
      [2_500_000, 2_600_000, 2_500_000, true],
      [2_600_000, 2_700_000, 0, true],
    ]);
    expect(spans(timelines(state({ loop: false })), 2_500_000, 2_700_000)).toEqual([
      [2_500_000, 2_600_000, 2_500_000, true],
      [2_600_000, 2_700_000, 2_600_000, false],
    ]);
  });

  test("cut where an edit takes effect", () => {
    const twice = timelines(
      state(),
      state({ epoch: 2, clock: UNIX + 120_000, position: 0 }),
      state({ epoch: 3, clock: UNIX + 150_000, position: 2_000_000 }),
    );
    expect(spans(twice, 100_000, 200_000)).toEqual([
      [100_000, 120_000, 0, false],
      [120_000, 150_000, 0, true],
      [150_000, 200_000, 2_000_000, true],
    ]);
    const sought = timelines(state(), state({ epoch: 2, clock: UNIX + 150_000, position: 2_000_000 }));
    expect(spans(sought, 100_000, 200_000)).toEqual([
      [100_000, 150_000, 100_000, true],
      [150_000, 200_000, 2_000_000, true],
    ]);
    const paused = timelines(state(), state({ epoch: 2, clock: UNIX + 150_000, position: 150_000, playing: false }));
    expect(spans(paused, 100_000, 200_000)).toEqual([
      [100_000, 150_000, 100_000, true],
      [150_000, 200_000, 150_000, false],
    ]);
  });
});

test("spans have no gaps, and are where the timelines are", () => {
  const one = fc.record({
    clock: fc.integer({ min: -300_000, max: 300_000 }),
    position: fc.integer({ min: 0, max: 90_000 }),
    playing: fc.boolean(),
    loop: fc.boolean(),
  });
  fc.assert(
    fc.property(
      fc.array(one, { minLength: 1, maxLength: 3 }),
      fc.integer({ min: 1, max: 90_000 }),
      fc.integer({ min: -400_000, max: 400_000 }),
      (edits, duration, from) => {
        const all = timelines(
          ...edits.map((edit, nth) =>
            state({
              ...edit,
              duration,
              epoch: nth + 1,
              clock: UNIX + edit.clock,
              position: Math.min(edit.position, duration),
            }),
          ),
        );
        const [begin, end] = [UNIX + from, UNIX + from + 62_500];
        const found = spansBetween(all, begin, end);
        expect([found[0].start, found.at(-1)!.end]).toEqual([begin, end]);
        found.forEach((span, nth) => {
          expect(span.end).toBeGreaterThan(span.start);
          if (nth > 0) expect(span.start).toBe(found[nth - 1].end);
          const middle = Math.floor((span.start + span.end) / 2);
          const expected = positionAt(all.at(middle)!, middle);
          expect(span.position + (span.isMoving ? middle - span.start : 0)).toBe(expected);
        });
      },
    ),
  );
});
