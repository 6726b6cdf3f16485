import { expect, test } from "vitest";
import { poseAt, sampleMotion } from "../../src/export/sampled-motion";
import { STAGE_CENTRE } from "../../src/motion/placement";
import { restPose } from "../../src/motion/skeleton";
import { MotionBlockStore } from "../../src/playout/block-store";
import { type BlockVectors, goldenTrack } from "../golden-motion";
import { decodeBase64, loadVectors } from "../golden-vectors";
import { goldenMotion, goldenStore, runToCompletion } from "./motions";

test("each frame is the pose of the best block at that frame", () => {
  const motion = goldenMotion();
  expect(motion).toMatchObject({ fps: goldenTrack().fps, frames: 78 });
  const { valid } = loadVectors<BlockVectors>("blocks");
  const pose = restPose();
  let compared = 0;
  for (const [block, first] of [
    [1, 0],
    [2, 30],
    [3, 60],
  ]) {
    for (const { instant, root, rotations } of valid[block].poses.filter((one) => Number.isInteger(one.instant))) {
      poseAt(motion, first + instant, pose);
      root.forEach((value, i) => expect(pose.root[i]).toBeCloseTo(value, 8));
      rotations.forEach((value, i) => expect(pose.rotations[i]).toBeCloseTo(value, 8));
      compared++;
    }
  }
  expect(compared).toBeGreaterThan(2);
});

test("a limited number of frames does not need the blocks after them", () => {
  const whole = goldenStore(),
    part = new MotionBlockStore(goldenTrack());
  for (const index of [0, 1])
    part.put(index, 1, decodeBase64(loadVectors<BlockVectors>("blocks").valid[index + 1].block));
  const motion = runToCompletion(sampleMotion(part, 45));
  expect([motion.frames, motion.roots.length, motion.placement]).toEqual([45, 135, STAGE_CENTRE]);
  expect(poseAt(motion, 44, restPose())).toEqual(poseAt(runToCompletion(sampleMotion(whole)), 44, restPose()));
});

test("a motion with a missing block is not sampled", () => {
  expect(() => runToCompletion(sampleMotion(new MotionBlockStore(goldenTrack())))).toThrow(
    "the block of frame 0 is not loaded",
  );
});
