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
/** Return a track set of performers with blocks of one second at these levels. */
const trackSet = (...performers: (number[] | null)[]) =>
  ({
    performers: performers.map(
      (levels) =>
        levels && {
          levels: Int8Array.from(levels),
          track: { blockAt: (position: number) => Math.min(Math.floor(position / 1e6), levels.length - 1) },
        },
    ),
    describedCount: 5,
  }) as unknown as TrackSet;

test("blocks are listed from the current one, wrapping at the end", () => {
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

test("at most 64 blocks are listed", () => {
  expect(haveQuery(Array(100).fill(3))).toBe(`dance.0.${"3".repeat(64)}.5`);
});

test("other performers have run lengths, and an unplayable one no blocks", () => {
  const others = [[...Array(31).fill(2), 0, -1, -1, 10, 10, 10], null, Array(100).fill(11)];
  expect(haveQuery([2, 2, 2], ...others)).toBe("dance.0.222.5.0.2z2o0-gah.0..0.bzbzbzb");
});

test("each performer is listed from its own current block", () => {
  const url = buildResumeUrl(
    new URL("ws://stage/stream"),
    trackSet([4, -1, 10, 0], [1, 2]),
    timeline,
    3_000_000,
    false,
  );
  expect(new URL(url).searchParams.get("have")).toBe("dance.2.a04-.5.1.21");
});
