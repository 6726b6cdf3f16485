import { expect, test } from "vitest";
import { poseOf, sample } from "../../src/export/dance";
import { restPose } from "../../src/motion/skeleton";
import { BlockStore } from "../../src/playout/blocks";
import { type BlockVectors, goldenTrack } from "../golden";
import { vectors } from "../vectors";
import { finished, goldenDance } from "./dances";

test("each frame is the best block's pose at that frame", () => {
  const dance = goldenDance();
  expect(dance).toMatchObject({ fps: goldenTrack().fps, frames: 78 });
  const { valid } = vectors<BlockVectors>("blocks");
  const pose = restPose();
  let compared = 0;
  for (const [block, first] of [[1, 0], [2, 30], [3, 60]]) {
    for (const { instant, root, rotations } of valid[block].poses.filter((one) => Number.isInteger(one.instant))) {
      poseOf(dance, first + instant, pose);
      root.forEach((value, i) => expect(pose.root[i]).toBeCloseTo(value, 8));
      rotations.forEach((value, i) => expect(pose.rotations[i]).toBeCloseTo(value, 8));
      compared++;
    }
  }
  expect(compared).toBeGreaterThan(2);
});

test("a motion of which a block is missing is not made up", () => {
  expect(() => finished(sample(new BlockStore(goldenTrack())))).toThrow("the block of frame 0 is not here");
});
