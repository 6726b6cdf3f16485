import { expect, test } from "vitest";
import { buildResumeUrl } from "../../src/client/resume-url";
import type { TrackSet } from "../../src/playout/track-set";
import type { TimelineState } from "../../src/wire/messages";

const timeline: TimelineState = {
  name: "TimelineState",
  epoch: 3,
  motion: "dance",
  clock: 1_000_000,
  position: 500_000,
  playing: true,
  loop: true,
  duration: 100_000_000,
};
/** Performers in blocks of a second. */
const trackSet = (...performers: (number[] | null)[]) =>
  ({
    performers: performers.map(
      (rates) =>
        rates && {
          rates: Int8Array.from(rates),
          track: { blockAt: (position: number) => Math.min(Math.floor(position / 1e6), rates.length - 1) },
        },
    ),
    told: 5,
  }) as unknown as TrackSet;

test("blocks are told of from the one on show on, around the end", () => {
  const url = buildResumeUrl(new URL("ws://stage/stream?rate=2"), trackSet([4, -1, 10, 0]), timeline, 3_000_000, true);
  expect(url).toBe("ws://stage/stream?rate=2&have=dance.2.a04-.5&at=2.500000&clock=3000000");
});

function haveQuery(...performers: (number[] | null)[]): string {
  const url = new URL(
    buildResumeUrl(new URL("ws://stage/stream"), trackSet(...performers), timeline, 1_000_000, false),
  );
  expect(url.searchParams.has("at")).toBe(false);
  return url.searchParams.get("have")!;
}

test("of a long motion only what comes next is told", () => {
  expect(haveQuery(Array(100).fill(3))).toBe(`dance.0.${"3".repeat(64)}.5`);
});

test("of other performers as much is told, in short, and of one that cannot be read that nothing is here", () => {
  const others = [[...Array(31).fill(2), 0, -1, -1, 10, 10, 10], null, Array(100).fill(11)];
  expect(haveQuery([2, 2, 2], ...others)).toBe("dance.0.222.5.0.2z2o0-gah.0..0.bzbzbzb");
});

test("each is told of from its own block on show on", () => {
  const url = buildResumeUrl(
    new URL("ws://stage/stream"),
    trackSet([4, -1, 10, 0], [1, 2]),
    timeline,
    3_000_000,
    false,
  );
  expect(new URL(url).searchParams.get("have")).toBe("dance.2.a04-.5.1.21");
});
