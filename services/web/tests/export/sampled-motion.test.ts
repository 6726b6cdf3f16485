import { expect, test } from "vitest";
import { faceWeightsAt, frameValuesAt, poseAt, sampleMotion } from "../../src/export/sampled-motion";
import { EXPRESSIONS, faceExpressions } from "../../src/motion/face";
import { STAGE_CENTRE } from "../../src/motion/placement";
import { restPose } from "../../src/motion/skeleton";
import { MotionBlockStore } from "../../src/playout/block-store";
import { ExtensionBlockStore } from "../../src/playout/extension-values";
import { goldenHandsFaceTrack, handsFaceVectors } from "../golden-hands-face";
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

test("fingers and face are sampled from their stores at every frame", () => {
  const golden = handsFaceVectors();
  const storeOf = (track: number) => {
    const extension = new ExtensionBlockStore(goldenHandsFaceTrack(golden.tracks[track]));
    const blocks = golden.valid.filter((vector) => vector.track === track);
    blocks.slice(0, blocks.length / 2).forEach(({ block }, index) => {
      extension.put(index, 0, decodeBase64(block));
    });
    return extension;
  };
  const extensions = { fingers: storeOf(0), face: storeOf(2) };
  const store = goldenStore();
  const motion = runToCompletion(sampleMotion(store, 45, extensions));
  const values = new Float64Array(90);
  extensions.fingers.valuesAt((44 * 1e6) / store.track.fps, false, store.track.durationUs, values);
  expect(values.some((value) => value !== 0)).toBe(true);
  expect(frameValuesAt(motion, 44)).toEqual({ extension: null, hands: values });
  const axes = new Float64Array(extensions.face.track.layout.count * 3);
  extensions.face.valuesAt(0, false, store.track.durationUs, axes);
  const weights = new Float64Array(EXPRESSIONS.length);
  const { content } = extensions.face.track;
  if (content.part === "face") faceExpressions(content.face, axes, weights);
  expect(weights.some((weight) => weight > 0.1)).toBe(true);
  expect(faceWeightsAt(motion, 0)).toEqual(weights);
  expect(faceWeightsAt(goldenMotion(), 0)).toBe(null);
});
