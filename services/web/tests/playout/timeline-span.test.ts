import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import { positionAt, TimelineHistory } from "../../src/playout/timeline";
import { spansBetween } from "../../src/playout/timeline-span";
import type { TimelineState } from "../../src/wire/messages";

const EPOCH_US = 1_774_000_000_000_000;

function state(change: Partial<TimelineState> = {}): TimelineState {
  return {
    name: "TimelineState",
    epoch: 1,
    motion: "dance",
    clock: EPOCH_US,
    position: 0,
    playing: true,
    loop: true,
    duration: 2_600_000,
    ...change,
  };
}

function timelines(...states: TimelineState[]): TimelineHistory {
  const all = new TimelineHistory();
  for (const state of states) all.put(state);
  return all;
}

/** Return the spans with clock times relative to `EPOCH_US`. */
function spans(all: TimelineHistory, from: number, to: number): unknown[] {
  return spansBetween(all, EPOCH_US + from, EPOCH_US + to).map((span) => [
    span.start - EPOCH_US,
    span.end - EPOCH_US,
    span.position,
    span.isMoving,
  ]);
}

test("there are no spans before the first timeline", () => {
  expect(spansBetween(new TimelineHistory(), 0, 1e6)).toEqual([]);
});

describe("interval", () => {
  test("is one span if the motion plays, stands, or has not begun", () => {
    expect(spans(timelines(state()), 100_000, 200_000)).toEqual([[100_000, 200_000, 100_000, true]]);
    expect(spans(timelines(state({ playing: false, position: 7 })), 100_000, 200_000)).toEqual([
      [100_000, 200_000, 7, false],
    ]);
    expect(spans(timelines(state({ position: 7 })), -200_000, -100_000)).toEqual([[-200_000, -100_000, 7, false]]);
  });

  test("is cut at the begin, at a loop's restart, and at the end", () => {
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

  test("is cut where an edit takes effect", () => {
    const twice = timelines(
      state(),
      state({ epoch: 2, clock: EPOCH_US + 120_000, position: 0 }),
      state({ epoch: 3, clock: EPOCH_US + 150_000, position: 2_000_000 }),
    );
    expect(spans(twice, 100_000, 200_000)).toEqual([
      [100_000, 120_000, 0, false],
      [120_000, 150_000, 0, true],
      [150_000, 200_000, 2_000_000, true],
    ]);
    const afterSeek = timelines(state(), state({ epoch: 2, clock: EPOCH_US + 150_000, position: 2_000_000 }));
    expect(spans(afterSeek, 100_000, 200_000)).toEqual([
      [100_000, 150_000, 100_000, true],
      [150_000, 200_000, 2_000_000, true],
    ]);
    const paused = timelines(
      state(),
      state({ epoch: 2, clock: EPOCH_US + 150_000, position: 150_000, playing: false }),
    );
    expect(spans(paused, 100_000, 200_000)).toEqual([
      [100_000, 150_000, 100_000, true],
      [150_000, 200_000, 150_000, false],
    ]);
  });
});

test("spans have no gaps and match the timelines", () => {
  const editValues = fc.record({
    clock: fc.integer({ min: -300_000, max: 300_000 }),
    position: fc.integer({ min: 0, max: 90_000 }),
    playing: fc.boolean(),
    loop: fc.boolean(),
  });
  fc.assert(
    fc.property(
      fc.array(editValues, { minLength: 1, maxLength: 3 }),
      fc.integer({ min: 1, max: 90_000 }),
      fc.integer({ min: -400_000, max: 400_000 }),
      (edits, duration, from) => {
        const all = timelines(
          ...edits.map((edit, nth) =>
            state({
              ...edit,
              duration,
              epoch: nth + 1,
              clock: EPOCH_US + edit.clock,
              position: Math.min(edit.position, duration),
            }),
          ),
        );
        const [begin, end] = [EPOCH_US + from, EPOCH_US + from + 62_500];
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
