import * as fc from "fast-check";
import { expect, test } from "vitest";
import { DamagedBlock } from "../../src/codec/errors";
import { applyPlacement } from "../../src/motion/placement";
import { restPose } from "../../src/motion/skeleton";
import { LIVE_HOLD_US, LiveBuffer, MAX_FRAMES } from "../../src/playout/live-buffer";
import { TrackSet } from "../../src/playout/track-set";
import { unpack } from "../../src/wire/codec";
import { LIVE_FRAME_INTERVAL_US, type Live } from "../../src/wire/live";
import type { Description } from "../../src/wire/messages";
import { goldenLiveTrack, type LiveVectors } from "../golden-live";
import { decodeBase64, loadVectors } from "../golden-vectors";

const golden = loadVectors<LiveVectors>("live");
const track = goldenLiveTrack();
/** Blocks of one frame, of two and of sixteen. */
const [one, two, sixteen] = [0, 1, 4].map((nth) => ({ ageUs: 0, data: decodeBase64(golden.valid[nth].block) }));
const BEGIN = 1_774_000_000_000_000;

function buffer(...puts: [due: number, frames: number, block: typeof one][]): LiveBuffer {
  const live = new LiveBuffer(track);
  for (const put of puts) live.put(...put);
  return live;
}

/** Returns the numbers of the pose at `clock`, or null. */
function poseAt(live: LiveBuffer, clock: number): number[] | null {
  const pose = restPose();
  return live.poseAt(clock, pose) ? [...pose.root, ...pose.rotations] : null;
}

test("messages of the vectors give the recorded poses on the stage", () => {
  const { description, messages, poses } = golden.show;
  const { performers } = new TrackSet((unpack(decodeBase64(description)) as Description).tracks);
  const buffers = performers.map((store) => new LiveBuffer(store!.track));
  for (const message of messages) {
    const { due, frames, blocks } = unpack(decodeBase64(message)) as Live;
    for (const [performer, block] of blocks) buffers[performer].put(due, frames, block);
  }
  for (const { clock, performers: expected } of poses) {
    expected.forEach((wanted, performer) => {
      const pose = restPose();
      expect(buffers[performer].poseAt(clock, pose)).toBe(wanted !== null);
      if (!wanted) return;
      applyPlacement(pose, performers[performer]!.track.placement);
      wanted.root.forEach((value, i) => expect(Math.abs(pose.root[i] - value)).toBeLessThan(1e-9));
      wanted.rotations.forEach((value, i) => expect(Math.abs(pose.rotations[i] - value)).toBeLessThan(1e-9));
    });
  }
});

test("pose holds for a while, then there is none, and the output stays as it was", () => {
  const live = buffer([BEGIN, 1, one]);
  expect(poseAt(live, BEGIN - 1)).toBeNull();
  expect(poseAt(live, BEGIN + LIVE_HOLD_US)).toEqual(poseAt(live, BEGIN));
  expect(poseAt(live, BEGIN + LIVE_HOLD_US + 1)).toBeNull();
  const pose = restPose();
  expect(live.poseAt(BEGIN - 1, pose)).toBe(false);
  expect(pose).toEqual(restPose());
});

test("after a gap a pose takes effect when it is due", () => {
  const live = buffer([BEGIN, 1, one], [BEGIN + LIVE_HOLD_US + 100, 2, two]);
  const first = BEGIN + LIVE_HOLD_US + 100 - LIVE_FRAME_INTERVAL_US;
  // the first frame of the two is within the hold of the pose before, and interpolated
  expect(poseAt(live, first - 1)).not.toEqual(poseAt(live, BEGIN));
  const far = buffer([BEGIN, 1, one], [BEGIN + 2 * LIVE_HOLD_US, 1, one]);
  expect(poseAt(far, BEGIN + LIVE_HOLD_US)).toEqual(poseAt(far, BEGIN));
});

test("order and repetition of messages do not matter", () => {
  const puts = Array.from({ length: 12 }, (_, nth): [number, number, typeof one] =>
    nth % 3 === 0 ? [BEGIN + nth * 40_000, 1, one] : [BEGIN + nth * 40_000, 2, two],
  );
  const expected = buffer(...puts);
  const clocks = Array.from({ length: 60 }, (_, nth) => BEGIN - 20_000 + nth * 9_000);
  fc.assert(
    fc.property(fc.shuffledSubarray([...puts, ...puts], { minLength: 24 }), (shuffled) => {
      const live = buffer(...shuffled);
      for (const clock of clocks) expect(poseAt(live, clock)).toEqual(poseAt(expected, clock));
    }),
    { numRuns: 50 },
  );
});

test("memory is bounded, and the oldest poses are dropped", () => {
  const live = new LiveBuffer(track);
  for (let nth = 0; nth < 20; nth++) live.put(BEGIN + 16 * nth * LIVE_FRAME_INTERVAL_US, 16, sixteen);
  expect(live.length).toBe(MAX_FRAMES);
  const oldest = BEGIN + (16 * 19 - MAX_FRAMES + 1) * LIVE_FRAME_INTERVAL_US;
  expect(poseAt(live, oldest - 1)).toBeNull();
  expect(poseAt(live, oldest)).not.toBeNull();
  const newest = poseAt(live, BEGIN + 16 * 19 * LIVE_FRAME_INTERVAL_US);
  // a pose before all that are held is ignored; one between them takes the place of the oldest
  live.put(BEGIN, 1, one);
  expect(poseAt(live, oldest - 1)).toBeNull();
  live.put(oldest + 1.5 * LIVE_FRAME_INTERVAL_US, 1, one);
  expect(live.length).toBe(MAX_FRAMES);
  expect(poseAt(live, oldest)).toBeNull();
  expect(poseAt(live, oldest + 1.5 * LIVE_FRAME_INTERVAL_US)).toEqual(poseAt(buffer([0, 1, one]), 0));
  expect(poseAt(live, BEGIN + 16 * 19 * LIVE_FRAME_INTERVAL_US)).toEqual(newest);
});

test("damaged block leaves the buffer as it was", () => {
  const live = buffer([BEGIN, 2, two]);
  for (const { frames, block } of golden.invalid)
    expect(() => live.put(BEGIN + 50_000, frames, { ageUs: 0, data: decodeBase64(block) })).toThrow(DamagedBlock);
  expect(live.length).toBe(2);
});
