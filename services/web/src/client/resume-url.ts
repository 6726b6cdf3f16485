/** URL with which a viewer resumes after a lost connection (`proto/server.md`, 6.1: `have`, `at`, `clock`). */

import type { MotionBlockStore } from "../playout/block-store";
import { positionAt } from "../playout/timeline";
import type { TrackSet } from "../playout/track-set";
import type { TimelineState } from "../wire/messages";

/** Blocks that are listed for each performer. */
const MAX_BLOCKS = 64;

/**
 * Return `url` with the blocks that `tracks` hold of the timeline's motion, listed from the position at clock time
 * `clock` on. For a private timeline that position is added, too.
 */
export function buildResumeUrl(
  url: URL,
  tracks: TrackSet,
  timeline: TimelineState,
  clock: number,
  hasPrivateTimeline: boolean,
): string {
  const address = new URL(url);
  const position = positionAt(timeline, clock);
  const [first, ...others] = tracks.performers.map((store) => formatHeldBlocks(store, position));
  // the first performer has no run lengths, since servers without support for several performers parse it
  const parts = [timeline.motion, first, tracks.describedCount, ...others.map(shortenRuns)];
  address.searchParams.set("have", parts.join("."));
  if (hasPrivateTimeline) {
    address.searchParams.set("at", (position / 1e6).toFixed(6));
    address.searchParams.set("clock", String(Math.round(clock)));
  }
  return address.href;
}

/**
 * Return the index of the block at `position`, and one digit for its level and those of the blocks after it, wrapping
 * at the end. A performer that cannot be played holds no blocks.
 */
function formatHeldBlocks(store: MotionBlockStore | null, position: number): string {
  if (!store) return "0.";
  const { levels, track } = store;
  const block = track.blockAt(position);
  let digits = "";
  for (let n = 0; n < Math.min(levels.length, MAX_BLOCKS); n++) {
    const level = levels[(block + n) % levels.length];
    digits += level < 0 ? "-" : level.toString(16);
  }
  return `${block}.${digits}`;
}

/** Replace 1 to 20 repetitions of a digit by a letter from g to z. */
function shortenRuns(text: string): string {
  const [block, digits] = text.split(".");
  const shortened = digits.replace(
    /(.)\1{1,20}/g,
    (run, digit: string) => digit + String.fromCharCode(101 + run.length),
  );
  return `${block}.${shortened}`;
}
