import { describe, expect, test } from "vitest";
import { DamagedBlock } from "../../src/codec/errors";
import { decodeMotionBlock } from "../../src/codec/motion-decoder";
import { SceneTrack } from "../../src/codec/scene";
import { restPose } from "../../src/motion/skeleton";
import { MotionBlockStore, SceneBlockStore } from "../../src/playout/block-store";
import { type BlockVectors, goldenTrack } from "../golden-motion";
import { goldenCameraBlocks, goldenCameraNumbers, goldenScene } from "../golden-scenes";
import { decodeBase64, loadVectors } from "../golden-vectors";

const golden = loadVectors<BlockVectors>("blocks").valid;
// three blocks of 30, 30 and 18 frames at 30 fps
const track = goldenTrack();
const [best, lowest, middle, last] = golden.map((vector) => decodeBase64(vector.block));

function createFullStore(): MotionBlockStore {
  const store = new MotionBlockStore(track);
  store.put(0, 1, best);
  store.put(1, 0, lowest);
  store.put(2, 0, last);
  return store;
}

test("golden track has three blocks", () => {
  expect([track.blockCount, track.framesIn(0), track.framesIn(2), track.durationUs]).toEqual([3, 30, 18, 2_600_000]);
});

describe("put", () => {
  test("stores the highest level of each block", () => {
    const store = new MotionBlockStore(track);
    expect([...store.levels]).toEqual([-1, -1, -1]);
    expect(store.put(1, 1, middle)).toBe(true);
    expect(store.put(1, 0, lowest)).toBe(false);
    expect(store.put(1, 3, best)).toBe(true);
    expect([...store.levels]).toEqual([-1, 3, -1]);
    const actual = restPose(),
      expected = restPose();
    store.poseAt(1_000_000, false, actual);
    decodeMotionBlock(track, best).poseAt(0, expected);
    expect(actual).toEqual(expected);
  });

  test("rejects blocks that are damaged or of another track", () => {
    const store = new MotionBlockStore(track);
    expect(() => store.put(3, 0, last)).toThrow(DamagedBlock);
    expect(() => store.put(0, 0, last)).toThrow("Block 0 has 18 frames, expected 30");
    expect(() => store.put(0, 0, best.subarray(0, 0))).toThrow(DamagedBlock);
    expect([...store.levels]).toEqual([-1, -1, -1]);
  });
});

describe("buffered duration", () => {
  test("ends at the first gap", () => {
    const store = new MotionBlockStore(track);
    expect(store.bufferedUs(0, true)).toBe(0);
    store.put(0, 0, best);
    expect(store.bufferedUs(250_000, true)).toBe(750_000);
    store.put(2, 0, last);
    expect(store.bufferedUs(250_000, true)).toBe(750_000);
    expect(store.bufferedUs(2_100_000, false)).toBe(500_000);
    expect(store.bufferedUs(2_100_000, true)).toBe(1_500_000);
  });

  test("is at most one loop", () => {
    expect(createFullStore().bufferedUs(700_000, true)).toBe(2_600_000);
    expect(createFullStore().bufferedUs(700_000, false)).toBe(1_900_000);
  });
});

describe("pose", () => {
  test("is unchanged if its block is missing", () => {
    const store = new MotionBlockStore(track);
    const pose = restPose();
    expect(store.poseAt(0, true, pose)).toBe(false);
    expect(pose).toEqual(restPose());
  });

  test("equals the block's at a frame", () => {
    const pose = restPose(),
      expected = restPose();
    createFullStore().poseAt(9.5e6 / 30, true, pose);
    decodeMotionBlock(track, best).poseAt(9.5, expected);
    pose.rotations.forEach((value, i) => expect(value).toBeCloseTo(expected.rotations[i], 12));
  });

  test("equals the block's if the first block is shorter", () => {
    const short = goldenTrack(1);
    const blocks = loadVectors<BlockVectors>("blocks")
      .valid.filter((vector) => vector.track === 1)
      .slice(0, 3);
    const store = new MotionBlockStore(short);
    blocks.forEach((vector, index) => expect(store.put(index, 0, decodeBase64(vector.block))).toBe(true));
    expect(store.bufferedUs(0, false)).toBe(short.durationUs);
    for (const [frame, index, instant] of [
      [2.5, 0, 2.5],
      [6, 1, 0],
      [16.25, 1, 10.25],
      [36, 2, 0],
      [40, 2, 4],
    ]) {
      const pose = restPose(),
        expected = restPose();
      store.poseAt((frame * 1e6) / short.fps, false, pose);
      decodeMotionBlock(short, decodeBase64(blocks[index].block)).poseAt(instant, expected);
      pose.rotations.forEach((value, i) => expect(value).toBeCloseTo(expected.rotations[i], 6));
      pose.root.forEach((value, i) => expect(value).toBeCloseTo(expected.root[i], 6));
    }
  });

  test("is interpolated between blocks without a step", () => {
    const store = createFullStore();
    const poses = [0, 1e-6, 0.5, 1 - 1e-6, 1].map((mix) => {
      const pose = restPose();
      store.poseAt(((29 + mix) * 1e6) / 30, true, pose);
      return pose;
    });
    const near = (a: Float64Array, b: Float64Array) =>
      a.forEach((value, i) => expect(Math.abs(value - b[i])).toBeLessThan(1e-5));
    near(poses[0].root, poses[1].root);
    near(poses[3].root, poses[4].root);
    const middleOfRoot = poses[0].root.map((value, i) => (value + poses[4].root[i]) / 2);
    near(poses[2].root, middleOfRoot);
    for (let at = 0; at < 72; at += 4) {
      expect(Math.hypot(...poses[2].rotations.subarray(at, at + 4))).toBeCloseTo(1, 9);
    }
  });

  test("is interpolated at the end of a loop, and stays without one", () => {
    const store = createFullStore();
    const first = restPose(),
      looped = restPose(),
      unlooped = restPose();
    store.poseAt(0, true, first);
    store.poseAt(2_600_000 - 0.01, true, looped);
    looped.root.forEach((value, i) => expect(Math.abs(value - first.root[i])).toBeLessThan(1e-5));
    store.poseAt(2_600_000, false, unlooped);
    const expected = restPose();
    decodeMotionBlock(track, last).poseAt(17.5, expected);
    expect(unlooped).toEqual(expected);
  });

  test("is constant past the end of a shorter track", () => {
    const store = createFullStore();
    const endPose = restPose(),
      pose = restPose(),
      looped = restPose();
    store.poseAt(2_600_000, false, endPose, 4_000_000);
    for (const position of [2_600_001, 3_000_000, 3_999_999]) {
      for (const loop of [true, false]) {
        expect(store.poseAt(position, loop, pose, 4_000_000)).toBe(true);
        expect(pose).toEqual(endPose);
      }
    }
    // a track that is shorter by less than a frame is interpolated at the end of a loop
    store.poseAt(2_600_000 - 0.01, true, looped);
    store.poseAt(2_600_000 - 0.01, true, pose, 2_633_000);
    expect(pose).toEqual(looped);
    expect(pose).not.toEqual(endPose);
  });

  test("of a longer track is not affected by the motion's duration", () => {
    const short = restPose(),
      whole = restPose();
    for (const position of [0, 500_000, 1_099_999, 1_100_000]) {
      createFullStore().poseAt(position, true, short, 1_100_000);
      createFullStore().poseAt(position, true, whole);
      expect(short).toEqual(whole);
    }
  });
});

describe("camera", () => {
  const DURATION = 2_600_000;

  function camera(...missing: number[]): SceneBlockStore {
    const store = new SceneBlockStore(SceneTrack.fromDescription(goldenScene()));
    goldenCameraBlocks[1].forEach((block, index) => missing.includes(index) || store.put(index, 1, block));
    return store;
  }

  function expectNear(actual: Float64Array | null, expected: readonly number[]): void {
    expect(actual).not.toBeNull();
    expected.forEach((value, i) => expect(Math.abs(actual![i] - value)).toBeLessThan(1e-6));
  }

  test("equals the block's at a frame, and stores blocks like a motion", () => {
    const store = camera();
    for (const index of [0, 1, 2]) {
      const [first, last] = goldenCameraNumbers(index);
      expectNear(store.sceneAt((index * 26 * 1e6) / 30, true, DURATION), first);
      expectNear(store.sceneAt(((index * 26 + 25) * 1e6) / 30, true, DURATION), last);
    }
    expect(store.put(0, 0, goldenCameraBlocks[0][0])).toBe(false);
    expect([...store.levels]).toEqual([1, 1, 1]);
    expect(store.bufferedUs(500_000, false)).toBe(2_100_000);
    expect(() => store.put(3, 1, goldenCameraBlocks[1][0])).toThrow(DamagedBlock);
  });

  test("is interpolated linearly between blocks and at the end of a loop", () => {
    const store = camera();
    for (const [before, after] of [
      [0, 1],
      [2, 0],
    ]) {
      const [[, last], [first]] = [goldenCameraNumbers(before), goldenCameraNumbers(after)];
      const quarter = last.map((value, i) => 0.75 * value + 0.25 * first[i]);
      expectNear(store.sceneAt(((before * 26 + 25.25) * 1e6) / 30, true, DURATION), quarter);
    }
  });

  test("is constant past the end of a shorter track", () => {
    const store = camera();
    const end = Float64Array.from(store.sceneAt(DURATION, true, 2 * DURATION)!);
    goldenCameraNumbers(2)[1].forEach((value, i) => expect(Math.abs(end[i] - value)).toBeLessThan(0.02));
    expect(store.sceneAt(1.9 * DURATION, true, 2 * DURATION)).toEqual(end);
  });

  test("is constant while a block is missing, and null before the first", () => {
    const store = camera(0);
    expect(store.sceneAt(0, true, DURATION)).toBeNull();
    const previous = Float64Array.from(store.sceneAt(1_000_000, true, DURATION)!);
    expect(store.sceneAt(0, true, DURATION)).toEqual(previous);
  });
});

test("mergeFrom copies higher levels and leaves the source unchanged", () => {
  const [store, source] = [new MotionBlockStore(track), new MotionBlockStore(track)];
  store.put(0, 1, best);
  source.put(0, 0, lowest);
  source.put(1, 0, middle);
  store.mergeFrom(source);
  expect([[...store.levels], [...source.levels]]).toEqual([
    [1, 0, -1],
    [0, 0, -1],
  ]);
  const pose = restPose();
  expect([0, 40e6 / 30, 70e6 / 30].map((position) => store.poseAt(position, false, pose))).toEqual([true, true, false]);
});
