import { expect, test } from "vitest";
import { createWorldTransforms, type Figure, worldTransforms } from "../../src/motion/skeleton";
import { ExtensionPoses } from "../../src/playout/extension-poses";
import type { Data, Track } from "../../src/wire/messages";
import { extensionVectors, goldenDescription } from "../golden-extensions";
import { decodeBase64 } from "../golden-vectors";

const golden = extensionVectors();
const vector = golden.poses[0];
const figure: Figure = { offsets: Float64Array.from(vector.offsets), tips: new Float64Array(54) };
const pose = { root: Float64Array.from(vector.root), rotations: Float64Array.from(vector.rotations) };
const tracks = new Map<number, Track>(golden.tracks.map((track, n) => [n + 4, goldenDescription(track)]));
const blocks = golden.valid.filter(({ track }) => track === 0);
/** Blocks of the better of two levels come last. */
const best = blocks.slice(blocks.length / 2);

function block(index: number, rate = 1): Data {
  return { name: "Data", track: 4, rate, index, block: decodeBase64(best[index].block) };
}

function extendedHead(poses: ExtensionPoses, position = 0): number[] {
  const extended = poses.performer(0)?.extend(figure, pose, position, false, 1_333_333);
  return [...(extended?.positions.slice(33, 36) ?? [])];
}

test("a performer without extension has none", () => {
  const poses = new ExtensionPoses();
  expect(poses.performer(0)).toBeNull();
  poses.add(tracks);
  expect(poses.performer(0)).not.toBeNull();
  expect(poses.performer(9)).toBeNull();
});

test("the joints follow the figure alone until a block is there", () => {
  const poses = new ExtensionPoses();
  poses.add(tracks);
  const alone = extendedHead(poses);
  expect(alone.every(Number.isFinite)).toBe(true);
  expect(poses.put(block(0))).toBe(true);
  const extended = extendedHead(poses);
  expect(extended).not.toEqual(alone);
  extended.forEach((value, i) => expect(value).toBeCloseTo(vector.positions[33 + i], 2));
});

test("a damaged block is reported, and an unknown track skipped", () => {
  const poses = new ExtensionPoses();
  poses.add(tracks);
  expect(poses.put({ ...block(0), block: new Uint8Array(70_000) })).toBe(false);
  expect(poses.put({ ...block(0), index: 99 })).toBe(false);
  expect(poses.put({ ...block(0), track: 1 })).toBe(true);
});

test("an unusable description is skipped", () => {
  const poses = new ExtensionPoses();
  poses.add(new Map([[1, { type: "extension", codec: "bunraku.extension/9" }]]));
  expect(poses.performer(0)).toBeNull();
});

test("the hands keep their orientation", () => {
  const poses = new ExtensionPoses();
  poses.add(tracks);
  const world = worldTransforms(figure, pose, createWorldTransforms());
  const extended = poses.performer(0)?.extend(figure, pose, 0, false, 1_333_333);
  expect([...(extended?.orientations.slice(14 * 4, 15 * 4) ?? [])]).toEqual([
    ...world.orientations.slice(14 * 4, 15 * 4),
  ]);
});
