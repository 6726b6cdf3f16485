/** Where a viewer connects that comes back after its line was lost (`proto/SPEC.md`, Sockets: `have`, `at`, `clock`). */
import { positionAt } from "../playout/timeline";
import type { Tracks } from "../playout/tracks";
import type { TimelineState } from "../wire/messages";

/** Blocks that may be told of. */
const MOST = 64;

/** `url` with what `tracks` hold of the motion of `timeline` at clock time `clock`, and where a private timeline then stands. */
export function returningUrl(url: URL, tracks: Tracks, timeline: TimelineState, clock: number, ownTimeline: boolean): string {
  const address = new URL(url);
  const { rates, track } = tracks.dance;
  const position = positionAt(timeline, clock);
  const block = track.blockAt(position);
  let digits = "";
  for (let n = 0; n < Math.min(rates.length, MOST); n++) {
    const rate = rates[(block + n) % rates.length];
    digits += rate < 0 ? "-" : rate.toString(16);
  }
  address.searchParams.set("have", `${timeline.motion}.${block}.${digits}.${tracks.told}`);
  if (ownTimeline) {
    address.searchParams.set("at", (position / 1e6).toFixed(6));
    address.searchParams.set("clock", String(Math.round(clock)));
  }
  return address.href;
}
