import { expect, test } from "vitest";
import { restPose } from "../../src/motion/skeleton";
import { MotionBlockStore } from "../../src/playout/block-store";
import { LivePoses } from "../../src/playout/live-poses";
import { goldenLiveTrack, type LiveVectors } from "../golden-live";
import { decodeBase64, loadVectors } from "../golden-vectors";

const golden = loadVectors<LiveVectors>("live");
const one = decodeBase64(golden.valid[0].block);
const damaged = decodeBase64(golden.invalid[0].block);
const store = () => new MotionBlockStore(goldenLiveTrack());

const message = (...blocks: [performer: number, data: Uint8Array, ageUs?: number][]) => ({
  name: "Live" as const,
  due: 1_000_000,
  frames: 1,
  blocks: new Map(blocks.map(([performer, data, ageUs = 60_000]) => [performer, { ageUs, data }])),
});

test("each performer has its poses; damaged blocks are counted, unknown performers skipped", () => {
  const poses = new LivePoses([store(), null, store()]);
  expect(poses.put(message([0, one], [1, one], [2, damaged], [3, damaged]), 0)).toBe(1);
  expect([0, 1, 2, 3].map((performer) => poses.poseAt(performer, 1_000_000, restPose()))).toEqual([
    true,
    false,
    false,
    false,
  ]);
  expect(poses.put(message([2, one]), 0)).toBe(0);
  expect(poses.poseAt(2, 1_000_000, restPose())).toBe(true);
});

test("age is that of the slowest performer, and none when nobody is live", () => {
  const poses = new LivePoses([store(), store()]);
  expect(poses.ageMs(0)).toBeNull();
  poses.put(message([0, one, 60_000], [1, one, 140_000]), 0);
  expect(poses.ageMs(0)).toBe(140);
  expect(poses.ageMs(60_000)).toBeNull();
});

test("another motion begins without poses", () => {
  const poses = new LivePoses([store()]);
  poses.put(message([0, one]), 0);
  poses.reset([null, store()]);
  expect([poses.poseAt(0, 1_000_000, restPose()), poses.ageMs(0)]).toEqual([false, null]);
  poses.put(message([0, one], [1, one]), 0);
  expect([0, 1].map((performer) => poses.poseAt(performer, 1_000_000, restPose()))).toEqual([false, true]);
});
