/** Several performers of a stream. */

import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import { Viewer } from "../../src/client/viewer";
import { decodeMotionBlock } from "../../src/codec/motion-decoder";
import { restPose } from "../../src/motion/skeleton";
import type { Message } from "../../src/wire/messages";
import { type BlockVectors, goldenDescription, goldenTrack } from "../golden-motion";
import { goldenScene } from "../golden-scenes";
import { decodeBase64, loadVectors } from "../golden-vectors";
import { FakeWebSocket } from "./fake-websocket";

const EPOCH_US = 1_774_000_000_000_000;
const golden = loadVectors<BlockVectors>("blocks").valid;
const [first, lowest] = golden.map((vector) => decodeBase64(vector.block));
/** Blocks of the second golden track; its duration is 1.1 s, that of the first 2.6 s. */
const short = golden
  .filter(({ track }) => track === 1)
  .slice(0, 3)
  .map((vector) => decodeBase64(vector.block));
/** Turn of the second performer, radians. */
const TURN = -2.25;

let now = 0;
let viewer: Viewer;
let events: string[];

/** Return three motion tracks with a camera between; the second one is placed, and shorter. */
const tracks = () => [
  goldenDescription(),
  goldenScene(),
  { ...goldenDescription(1), front: 0.5, place: [3, -1, TURN] },
  goldenDescription(),
];
const description = (all = tracks(), from = 0): Message => ({
  name: "Description",
  motion: "dance",
  first: from || null,
  tracks: all,
});
const data = (track: number, index: number, block: Uint8Array, rate = 1): Message => ({
  name: "Data",
  track,
  rate,
  index,
  block,
});

function start(...messages: Message[]): void {
  FakeWebSocket.last.receive(
    { name: "ChannelHeader", motion: "dance", now: EPOCH_US, channels: 60, software: "0", version: 1, clock: "unix" },
    ...messages,
    {
      name: "TimelineState",
      epoch: 1,
      motion: "dance",
      clock: EPOCH_US,
      position: 0,
      playing: true,
      loop: true,
      duration: 2_600_000,
    },
  );
}

function copyAt(performer?: number) {
  return structuredClone(viewer.poseAt(now, performer));
}

beforeEach(() => {
  FakeWebSocket.install();
  now = 0;
  events = [];
  viewer = new Viewer({ url: "ws://stage/v1/sessions/s1/stream", now: () => now, solver: null });
  for (const event of ["figure", "tracks", "blocks"]) viewer.addEventListener(event, () => events.push(event));
  FakeWebSocket.last.accept();
});
afterEach(() => {
  viewer.close();
  FakeWebSocket.remove();
  vi.restoreAllMocks();
});

test("there are no performers before the first Description", () => {
  expect([viewer.performers, viewer.poseAt(0), viewer.poseAt(0, 1)]).toEqual([[], null, null]);
});

test("performers have figure, facing and placement", () => {
  start(description());
  expect(viewer.performers.map((performer) => performer!.figure)).toEqual(
    [0, 1, 0].map((which) => goldenTrack(which).figure),
  );
  expect(viewer.performers.map((performer) => performer!.front)).toEqual([0, 0.5 + TURN, 0]);
  expect(viewer.performers[1]!.placement).toEqual({ x: 3, z: -1, turn: TURN });
  expect([viewer.figure, viewer.front]).toEqual([viewer.performers[0]!.figure, 0]);
  expect(viewer.duration).toBe(2.6);
});

test("performers are drawn from their blocks at their placements", () => {
  start(description());
  FakeWebSocket.last.receive(data(0, 0, first));
  now = 50;
  expect([viewer.poseAt(now, 1), viewer.poseAt(now, 2), viewer.poseAt(now, 3)]).toEqual([null, null, null]);
  FakeWebSocket.last.receive(data(2, 0, short[0]), data(3, 0, lowest, 0));
  const poses = [0, 1, 2].map((performer) => viewer.poseAt(now, performer)!);
  const expectedPoses = [
    [0, first, 1.5],
    [1, short[0], 0.05 * 59.94],
    [0, lowest, 1.5],
  ].map(([which, block, instant]) => {
    const pose = restPose();
    decodeMotionBlock(goldenTrack(which as number), block as Uint8Array).poseAt(instant as number, pose);
    return pose;
  });
  const [x, y, z] = expectedPoses[1].root;
  expectedPoses[1].root.set([
    3 + Math.cos(TURN) * x + Math.sin(TURN) * z,
    y,
    -1 + Math.cos(TURN) * z - Math.sin(TURN) * x,
  ]);
  expectedPoses.forEach(({ root, rotations }, performer) => {
    root.forEach((value, i) => expect(poses[performer].root[i]).toBeCloseTo(value, 9));
    rotations.subarray(4).forEach((value, i) => expect(poses[performer].rotations[4 + i]).toBeCloseTo(value, 9));
  });
  expect(viewer.blocksOf("dance", 1)?.levels[0]).toBe(1);
  expect([viewer.blocksOf("dance", 9), viewer.blocksOf("other", 1)]).toEqual([null, null]);
});

test("shorter track stands still past its end and restarts with the loop", () => {
  start(description());
  FakeWebSocket.last.receive(
    ...short.map((block, index) => data(2, index, block)),
    data(0, 0, first),
    data(0, 1, first),
  );
  const start1 = copyAt(1);
  now = 1_200;
  const lastPose = copyAt(1);
  expect(lastPose).not.toEqual(start1);
  now = 2_500;
  expect(copyAt(1)).toEqual(lastPose);
  now = 2_600;
  expect(copyAt(1)).toEqual(start1);
});

test("higher level is shown while paused", () => {
  start(description());
  FakeWebSocket.last.receive({
    name: "TimelineState",
    epoch: 2,
    motion: "dance",
    clock: EPOCH_US,
    position: 500_000,
    playing: false,
    loop: true,
    duration: 2_600_000,
  });
  FakeWebSocket.last.receive(data(0, 0, lowest, 0), data(3, 0, lowest, 0));
  now = 4_000;
  const firstPose = copyAt(0);
  expect(copyAt(2)).toEqual(firstPose);
  FakeWebSocket.last.receive(data(3, 0, first));
  expect(copyAt(0)).toEqual(firstPose);
  const expected = restPose();
  decodeMotionBlock(goldenTrack(), first).poseAt(15, expected);
  copyAt(2)!.rotations.forEach((value, i) => expect(value).toBeCloseTo(expected.rotations[i], 9));
});

test("statistics are those of the first performer", () => {
  start(description());
  FakeWebSocket.last.receive(data(0, 0, first), data(2, 0, short[0]), data(3, 0, lowest, 0));
  for (const performer of [0, 1, 2]) viewer.poseAt(now, performer);
  expect(events).toEqual(["figure", "blocks", "blocks"]);
  expect([...viewer.blocks]).toEqual([1, -1, -1]);
  now = 500;
  // a block of the second performer is missing
  for (const performer of [0, 1, 2]) viewer.poseAt(now, performer);
  let statistics = viewer.statistics();
  expect([statistics.rate, statistics.gaps, statistics.bufferSeconds]).toEqual([1, 0, 0.5]);
  now = 1_100;
  for (const performer of [0, 1, 2]) viewer.poseAt(now, performer);
  statistics = viewer.statistics();
  expect([statistics.gaps, statistics.reason]).toEqual([1, "waiting for a block"]);
});

test("overlay of the second performer leaves the others unchanged", () => {
  start(description());
  FakeWebSocket.last.receive(data(0, 0, first), data(2, 0, short[0]), data(3, 0, first));
  now = 50;
  const before = [0, 1, 2].map(copyAt);
  const limbs = new Map([[5, Int16Array.of(9_000, 0, 0, 0, 9_000, 0, 0, 0, 9_000)]]);
  for (const due of [40_000, 56_667])
    FakeWebSocket.last.receive({ name: "Overlay", sequence: 0, due: EPOCH_US + due, limbs, earlier: [] });
  const after = [0, 1, 2].map(copyAt);
  expect([after[0], after[2]]).toEqual([before[0], before[2]]);
  expect(after[1]!.rotations.subarray(60)).not.toEqual(before[1]!.rotations.subarray(60));
  expect(after[1]!.rotations.subarray(0, 60)).toEqual(before[1]!.rotations.subarray(0, 60));
  expect(after[1]!.root).toEqual(before[1]!.root);
});

describe("constrained link", () => {
  test("performers that are described later are added", () => {
    start(description(tracks().slice(0, 1)));
    FakeWebSocket.last.receive(data(0, 0, first));
    expect(viewer.performers).toHaveLength(1);
    const [firstView] = viewer.performers,
      pose = copyAt(0);
    FakeWebSocket.last.receive(description(tracks().slice(1, 3), 1));
    expect(viewer.performers).toHaveLength(2);
    FakeWebSocket.last.receive(description(tracks().slice(3), 3), data(3, 0, first));
    expect(viewer.performers).toHaveLength(3);
    expect(viewer.performers[0]).toBe(firstView);
    expect(events).toEqual(["figure", "blocks", "blocks", "tracks", "tracks"]);
    expect([copyAt(0), copyAt(1), copyAt(2)]).toEqual([pose, null, pose]);
  });

  test("reconnecting viewer lists the blocks of all performers", () => {
    start(description());
    FakeWebSocket.last.receive(data(0, 0, first), data(2, 1, short[1]));
    FakeWebSocket.last.endWith(1006);
    now += 250;
    vi.advanceTimersByTime(250);
    expect(new URL(FakeWebSocket.last.url).searchParams.get("have")).toBe("dance.0.1--.4.1.1-g.0.-h");
    FakeWebSocket.last.accept();
    start();
    expect(viewer.performers).toHaveLength(3);
    expect(viewer.blocksOf("dance", 1)?.levels[1]).toBe(1);
  });
});

test("performer that cannot be played is null, and the next keeps its number", () => {
  vi.spyOn(console, "warn").mockReturnValue();
  const [firstTrack, camera, secondTrack, thirdTrack] = tracks();
  start(description([firstTrack, camera, { ...secondTrack, codec: "bunraku.motion/9" }, thirdTrack]));
  FakeWebSocket.last.receive(data(0, 0, first), data(2, 0, short[0]), data(3, 0, first));
  expect(viewer.performers.map((performer) => performer !== null)).toEqual([true, false, true]);
  expect([viewer.poseAt(now, 1), viewer.damagedCount]).toEqual([null, 0]);
  const firstPose = copyAt(0);
  expect(copyAt(2)).toEqual(firstPose);
  FakeWebSocket.last.receive({
    name: "Overlay",
    sequence: 0,
    due: EPOCH_US,
    limbs: new Map([[8, new Int16Array(9)]]),
    earlier: [],
  });
  expect(copyAt(0)).toEqual(firstPose);
  expect([...copyAt(2)!.rotations.subarray(48, 52)]).toEqual([1, 0, 0, 0]);
});

test("another motion replaces the performers", () => {
  start(description());
  FakeWebSocket.last.receive(data(0, 0, first), data(2, 0, short[0]));
  viewer.poseAt(now, 1);
  FakeWebSocket.last.receive({
    name: "Description",
    motion: "other",
    first: null,
    tracks: [goldenDescription(1), goldenDescription()],
  });
  expect(viewer.performers.map((performer) => performer!.figure)).toEqual(
    [1, 0].map((which) => goldenTrack(which).figure),
  );
  FakeWebSocket.last.receive({
    name: "TimelineState",
    epoch: 2,
    motion: "other",
    clock: EPOCH_US,
    position: 0,
    playing: true,
    loop: true,
    duration: 1_101_101,
  });
  expect([0, 1, 2].map((performer) => viewer.poseAt(now, performer))).toEqual([null, null, null]);
  FakeWebSocket.last.receive(data(1, 0, first));
  expect(viewer.poseAt(now, 1)).not.toBeNull();
  expect(viewer.duration).toBeCloseTo(1.101, 3);
});
