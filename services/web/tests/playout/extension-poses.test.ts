import { describe, expect, test } from "vitest";
import type { ExtendedPose, StagedPose } from "../../src/motion/extension";
import { createWorldTransforms, type Figure, worldTransforms } from "../../src/motion/skeleton";
import { ExtensionPoses } from "../../src/playout/extension-poses";
import { openExtension } from "../../src/playout/extension-values";
import type { Data, Track } from "../../src/wire/messages";
import { contactVectors } from "../golden-contacts";
import { extensionVectors, goldenDescription } from "../golden-extensions";
import { goldenHandsFaceDescription, handsFaceVectors } from "../golden-hands-face";
import { propVectors } from "../golden-props";
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

function extendedAt(poses: ExtensionPoses, position: number): ExtendedPose | null {
  const staged: StagedPose = { ...pose };
  poses.performer(0)?.extend(figure, staged, { clock: 5, position, loop: false, duration: 1_333_333 });
  return staged.extended ?? null;
}

function extendedHead(poses: ExtensionPoses, position = 0): number[] {
  return [...(extendedAt(poses, position)?.positions.slice(33, 36) ?? [])];
}

test("a performer without extension has none", () => {
  const poses = new ExtensionPoses(openExtension);
  expect(poses.performer(0)).toBeNull();
  poses.add(tracks);
  expect(poses.performer(0)).not.toBeNull();
  expect(poses.performer(9)).toBeNull();
});

test("the joints follow the figure alone until a block is there", () => {
  const poses = new ExtensionPoses(openExtension);
  poses.add(tracks);
  const alone = extendedHead(poses);
  expect(alone.every(Number.isFinite)).toBe(true);
  expect(poses.put(block(0))).toBe(true);
  const extended = extendedHead(poses);
  expect(extended).not.toEqual(alone);
  extended.forEach((value, i) => expect(value).toBeCloseTo(vector.positions[33 + i], 2));
});

test("a damaged block is reported, and an unknown track skipped", () => {
  const poses = new ExtensionPoses(openExtension);
  poses.add(tracks);
  expect(poses.put({ ...block(0), block: new Uint8Array(70_000) })).toBe(false);
  expect(poses.put({ ...block(0), index: 99 })).toBe(false);
  expect(poses.put({ ...block(0), track: 1 })).toBe(true);
});

test("an unusable description is skipped", () => {
  const poses = new ExtensionPoses(openExtension);
  poses.add(new Map([[1, { type: "extension", codec: "bunraku.extension/9" }]]));
  expect(poses.performer(0)).toBeNull();
});

test("the hands keep their orientation", () => {
  const poses = new ExtensionPoses(openExtension);
  poses.add(tracks);
  const world = worldTransforms(figure, pose, createWorldTransforms());
  const extended = extendedAt(poses, 0);
  expect([...(extended?.orientations.slice(14 * 4, 15 * 4) ?? [])]).toEqual([
    ...world.orientations.slice(14 * 4, 15 * 4),
  ]);
});

describe("fingers and face", () => {
  const parts = handsFaceVectors();
  const staged = (received: readonly number[]) => {
    const poses = new ExtensionPoses(openExtension);
    poses.add(new Map(parts.tracks.map((track, n) => [n, { ...goldenHandsFaceDescription(track), performer: 0 }])));
    for (const { track, block: data } of parts.valid.filter((_, n) => received.includes(n)))
      poses.put({ name: "Data", track, rate: 0, index: 0, block: decodeBase64(data) });
    const pose3: StagedPose = { ...pose };
    poses.performer(0)?.extend(figure, pose3, { clock: 5, position: 0, loop: false, duration: 1_500_000 });
    return pose3;
  };
  const firstOf = (track: number) => parts.valid.findIndex((vector) => vector.track === track);

  test("are missing until a block is there", () => {
    expect(staged([])).toMatchObject({ hands: null, face: null });
  });

  test("are those of the first track of each part", () => {
    const { hands, face, extended } = staged([firstOf(0), firstOf(2)]);
    expect(extended).toBeUndefined();
    expect(hands?.hands.counts).toEqual(new Array(10).fill(3));
    const { numbers } = parts.valid[firstOf(0)].values[0];
    hands?.values.forEach((value, n) => expect(value).toBeCloseTo(numbers[n], 11));
    expect(face?.weights.length).toBe(parts.expressions.length);
    expect(face?.weights.some((weight) => weight > 0.1)).toBe(true);
  });
});

describe("contacts", () => {
  const contacts = contactVectors();
  const stagedAt = (position: number, received = contacts.valid): StagedPose => {
    const poses = new ExtensionPoses(openExtension);
    poses.add(new Map(contacts.tracks.map((track, n) => [n, track])));
    for (const { track, index, block: data } of received)
      expect(poses.put({ name: "Data", track, rate: 0, index, block: decodeBase64(data) })).toBe(true);
    const staged: StagedPose = { ...pose };
    poses.performer(0)?.extend(figure, staged, { clock: 5, position, loop: false, duration: 3_000_000 });
    return staged;
  };

  test("are those of the motion time, with the clock", () => {
    expect(stagedAt(0).contacts).toEqual({ planted: 3, controlled: 0, clock: 5 });
    expect(stagedAt(500_000).contacts).toEqual({ planted: 0, controlled: 0, clock: 5 });
    expect(stagedAt(2_900_000).contacts).toEqual({ planted: 3, controlled: 0, clock: 5 });
  });

  test("are none where a block is missing", () => {
    expect(stagedAt(0, []).contacts).toEqual({ planted: 0, controlled: 0, clock: 5 });
  });

  test("of an unknown codec are not known", () => {
    const poses = new ExtensionPoses(openExtension);
    poses.add(new Map([[1, { ...contacts.tracks[0], codec: "bunraku.contact/9" }]]));
    expect(poses.performer(0)).toBeNull();
  });
});

describe("props", () => {
  const props = propVectors();

  test("are those of all tracks at the motion time, with numbers of their own", () => {
    const poses = new ExtensionPoses(null);
    expect(poses.propsAt(0)).toEqual([]);
    poses.add(new Map(props.tracks.map((track, n) => [n, track])));
    expect(poses.propsAt(0)).toEqual([]);
    for (const { track, index, block: data } of props.valid)
      expect(poses.put({ name: "Data", track, rate: 0, index, block: decodeBase64(data) })).toBe(true);
    const staged = poses.propsAt(500_000);
    expect(staged.map(({ prop }) => prop)).toEqual([8, 9, 16, 24, 25, 26, 27, 28, 29, 30, 31]);
    expect(staged[2]).toEqual({ prop: 16, kind: "ball", limb: 4, place: [0, 0, 0] });
    expect(poses.put({ name: "Data", track: 0, rate: 1, index: 1, block: new Uint8Array(1) })).toBe(false);
  });
});
