import * as fc from "fast-check";
import { expect, test } from "vitest";
import { positionAt, TimelineHistory } from "../../src/playout/timeline";
import type { TimelineState } from "../../src/wire/messages";

function state(change: Partial<TimelineState> = {}): TimelineState {
  return {
    name: "TimelineState",
    epoch: 1,
    motion: "a",
    clock: 1_000,
    position: 500,
    playing: true,
    loop: true,
    duration: 4_000,
    ...change,
  };
}

test("position advances from the clock time on, unless paused", () => {
  expect(positionAt(state(), 2_000)).toBe(1_500);
  expect(positionAt(state(), 10)).toBe(500);
  expect(positionAt(state({ playing: false }), 9_000)).toBe(500);
});

test("position wraps in a loop, and stays at the end without one", () => {
  expect(positionAt(state(), 1_000 + 3_500)).toBe(0);
  expect(positionAt(state({ loop: false }), 1_000_000)).toBe(4_000);
});

test("position is always within the motion", () => {
  fc.assert(
    fc.property(fc.nat(1e9), fc.nat(4_000), fc.boolean(), fc.boolean(), (clock, position, playing, loop) => {
      const at = positionAt(state({ position, playing, loop }), clock);
      expect(at).toBeGreaterThanOrEqual(0);
      expect(at).toBeLessThanOrEqual(4_000);
    }),
  );
});

test("higher epoch applies from its clock time on", () => {
  const timelines = new TimelineHistory();
  expect(timelines.at(0)).toBeNull();
  const first = state(),
    second = state({ epoch: 2, clock: 5_000 });
  expect(timelines.put(first)).toBe(true);
  expect(timelines.put(second)).toBe(true);
  expect(timelines.put(state({ epoch: 2, clock: 1 }))).toBe(false);
  expect(timelines.newest).toBe(second);
  expect(timelines.at(4_999)).toBe(first);
  expect(timelines.at(5_000)).toBe(second);
});

test("timeline of another motion applies at once", () => {
  const timelines = new TimelineHistory();
  timelines.put(state());
  const other = state({ epoch: 2, motion: "b", clock: 9_000 });
  timelines.put(other);
  expect(timelines.at(2_000)).toBe(other);
});

test("restart accepts any epoch", () => {
  const timelines = new TimelineHistory();
  timelines.put(state({ epoch: 9 }));
  timelines.restart();
  expect(timelines.at(2_000)?.position).toBe(500);
  expect(timelines.put(state({ epoch: 1, position: 700 }))).toBe(true);
  expect(timelines.at(1_000)?.position).toBe(700);
});
