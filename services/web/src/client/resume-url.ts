/** Where a viewer connects that comes back after its line was lost (`proto/SPEC.md`, Sockets: `have`, `at`, `clock`). */
import type { MotionBlockStore } from "../playout/block-store";
import { positionAt } from "../playout/timeline";
import type { TrackSet } from "../playout/track-set";
import type { TimelineState } from "../wire/messages";

/** Blocks of each performer that may be told of. */
const MAX_BLOCKS = 64;

/** `url` with what `tracks` hold of the motion of `timeline` at clock time `clock`, and where a private timeline then stands. */
export function buildResumeUrl(
  url: URL,
  tracks: TrackSet,
  timeline: TimelineState,
  clock: number,
  hasOwnTimeline: boolean,
): string {
  const address = new URL(url);
  const position = positionAt(timeline, clock);
  const [first, ...others] = tracks.performers.map((store) => formatHeldBlocks(store, position));
  // of the first all digits: servers that know of no others read that
  const said = [timeline.motion, first, tracks.describedCount, ...others.map(shortenRuns)];
  address.searchParams.set("have", said.join("."));
  if (hasOwnTimeline) {
    address.searchParams.set("at", (position / 1e6).toFixed(6));
    address.searchParams.set("clock", String(Math.round(clock)));
  }
  return address.href;
}

/** Of one performer the block at `position`, and from it on, around the end, a digit for the rate of each; of one that cannot be read nothing. */
function formatHeldBlocks(store: MotionBlockStore | null, position: number): string {
  if (!store) return "0.";
  const { levels: rates, track } = store;
  const block = track.blockAt(position);
  let digits = "";
  for (let n = 0; n < Math.min(rates.length, MAX_BLOCKS); n++) {
    const rate = rates[(block + n) % rates.length];
    digits += rate < 0 ? "-" : rate.toString(16);
  }
  return `${block}.${digits}`;
}

/** With a letter, g to z, for 1 to 20 of the same digit that follow. */
function shortenRuns(text: string): string {
  const [block, digits] = text.split(".");
  return `${block}.${digits.replace(/(.)\1{1,20}/g, (run, digit: string) => digit + String.fromCharCode(101 + run.length))}`;
}
