import { expect, test } from "vitest";
import { poseOf, sample } from "../../src/export/dance";
import { MIDDLE } from "../../src/motion/performer";
import { restPose } from "../../src/motion/skeleton";
import { BlockStore } from "../../src/playout/blocks";
import { type BlockVectors, goldenTrack } from "../golden";
import { bytes, vectors } from "../vectors";
import { finished, goldenDance, goldenStore } from "./dances";

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

test("as many frames are taken as are danced, without the blocks that come after them", () => {
  const whole = goldenStore(), part = new BlockStore(goldenTrack());
  for (const index of [0, 1]) part.put(index, 1, bytes(vectors<BlockVectors>("blocks").valid[index + 1].block));
  const dance = finished(sample(part, 45));
  expect([dance.frames, dance.roots.length, dance.place]).toEqual([45, 135, MIDDLE]);
  expect(poseOf(dance, 44, restPose())).toEqual(poseOf(finished(sample(whole)), 44, restPose()));
});

test("a motion of which a block is missing is not made up", () => {
  expect(() => finished(sample(new BlockStore(goldenTrack())))).toThrow("the block of frame 0 is not here");
});
