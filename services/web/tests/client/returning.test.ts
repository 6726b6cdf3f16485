import { expect, test } from "vitest";
import { returningUrl } from "../../src/client/returning";
import type { Tracks } from "../../src/playout/tracks";
import type { TimelineState } from "../../src/wire/messages";

const timeline: TimelineState = {
  name: "TimelineState", epoch: 3, motion: "dance", clock: 1_000_000, position: 500_000, playing: true, loop: true, duration: 100_000_000,
};
const holding = (rates: number[]) =>
  ({ dance: { rates: Int8Array.from(rates), track: { blockAt: (position: number) => Math.floor(position / 1e6) } }, told: 5 }) as unknown as Tracks;

test("blocks are told of from the one on show on, around the end", () => {
  const url = returningUrl(new URL("ws://stage/stream?rate=2"), holding([4, -1, 10, 0]), timeline, 3_000_000, true);
  expect(url).toBe("ws://stage/stream?rate=2&have=dance.2.a04-.5&at=2.500000&clock=3000000");
});

test("of a long motion only what comes next is told", () => {
  const url = new URL(returningUrl(new URL("ws://stage/stream"), holding(Array(100).fill(3)), timeline, 1_000_000, false));
  expect(url.searchParams.get("have")).toBe(`dance.0.${"3".repeat(64)}.5`);
  expect(url.searchParams.has("at")).toBe(false);
});
