/** Live performers of a stream. */

import { describe, expect, test, vi } from "vitest";
import { LiveTrack } from "../../src/codec/live";
import { decodeMotionBlock } from "../../src/codec/motion-decoder";
import { applyPlacement } from "../../src/motion/placement";
import { type Pose, restPose } from "../../src/motion/skeleton";
import { pack } from "../../src/wire/codec";
import type { Message } from "../../src/wire/messages";
import { goldenLiveDescription, goldenLiveTrack, type LiveVectors } from "../golden-live";
import { goldenDescription } from "../golden-motion";
import { decodeBase64, loadVectors } from "../golden-vectors";
import { FakeWebSocket } from "./fake-websocket";
import {
  advanceTime,
  advanceTimeAnswered,
  best,
  createViewer,
  EPOCH_US,
  expectNear,
  header,
  isolateViewers,
  now,
  timeline,
  viewer,
} from "./viewer-suite";

isolateViewers();

const golden = loadVectors<LiveVectors>("live");
const PLACE = [2, -1, 0.5];
const [one, two, , four] = golden.valid.map(({ block }) => decodeBase64(block));

/**
 * Open a viewer of a stored performer and one whose live blocks are the golden ones; the decoder of these is loaded.
 */
async function openLiveViewer(motion = "dance"): Promise<void> {
  createViewer();
  FakeWebSocket.last.accept();
  FakeWebSocket.last.receive(header(motion));
  await loadDecoder();
  FakeWebSocket.last.receive(description(motion), timeline({ motion }));
}

/** Send a message for which the viewer loads the decoder; without a description it has no other effect. */
async function loadDecoder(): Promise<void> {
  FakeWebSocket.last.receive(live(0, 1, one));
  await vi.dynamicImportSettled();
}

function description(motion = "dance"): Message {
  const tracks = [goldenDescription(), { ...goldenLiveDescription(), place: PLACE }];
  return { name: "Description", motion, first: null, tracks };
}

/** Return a message whose last frame is due at `due`, microseconds after the start. */
function live(due: number, frames: number, data: Uint8Array, performer = 1, ageUs = 60_000): Message {
  return { name: "Live", due: EPOCH_US + due, frames, blocks: new Map([[performer, { ageUs, data }]]) };
}

function livePose(frames: number, data: Uint8Array, frame: number): Pose {
  const pose = restPose();
  new LiveTrack(goldenLiveTrack()).decode(frames, data).poseAt(frame, pose);
  return applyPlacement(pose, { x: 2, z: -1, turn: 0.5 });
}

/** Return the stored pose of a block's first frame. */
function storedPose(frame: number): Pose {
  const pose = restPose();
  decodeMotionBlock(goldenLiveTrack(), best).poseAt(frame, pose);
  return applyPlacement(pose, { x: 2, z: -1, turn: 0.5 });
}

function expectPose(actual: Pose | null, expected: Pose): void {
  expectNear(actual!.root, expected.root);
  expectNear(actual!.rotations, expected.rotations);
}

test("live pose replaces the stored one at its place, holds, and gives way again", async () => {
  await openLiveViewer();
  FakeWebSocket.last.receive({ name: "Data", track: 1, rate: 1, index: 0, block: best });
  FakeWebSocket.last.receive(live(50_000, 1, one), live(100_000, 2, two));
  expectPose(viewer.poseAt(now, 1), storedPose(0));
  advanceTime(50);
  expectPose(viewer.poseAt(now, 1), livePose(1, one, 0));
  advanceTime(50);
  expectPose(viewer.poseAt(now, 1), livePose(2, two, 1));
  advanceTime(500);
  expectPose(viewer.poseAt(now, 1), livePose(2, two, 1));
  advanceTime(100);
  expectPose(viewer.poseAt(now, 1), storedPose(21));
});

test("live performer is shown before its stored blocks, and the first pose counts", async () => {
  await openLiveViewer();
  expect(viewer.statistics().reason).toBe("waiting for the first block");
  advanceTime(40);
  FakeWebSocket.last.receive(live(40_000, 4, four, 0), live(40_000, 4, four, 1));
  expectPose(viewer.poseAt(now, 1), livePose(4, four, 3));
  expect(viewer.poseAt(now, 0)).not.toBeNull();
  const { firstPoseMs, gaps, reason } = viewer.statistics();
  expect([firstPoseMs, gaps, reason]).toEqual([40, 0, "chosen by the server"]);
});

test("messages that arrive before the decoder are left out", async () => {
  createViewer();
  FakeWebSocket.last.accept();
  FakeWebSocket.last.receive(header(), description(), timeline(), live(0, 1, one));
  expect([viewer.poseAt(now, 1), viewer.damagedCount]).toEqual([null, 0]);
  await vi.dynamicImportSettled();
  FakeWebSocket.last.receive(live(0, 1, one));
  expectPose(viewer.poseAt(now, 1), livePose(1, one, 0));
});

test("latency is that of the slowest performer", async () => {
  await openLiveViewer();
  FakeWebSocket.last.receive(live(0, 1, one, 0, 140_000), live(0, 1, one, 1, 60_000));
  expect(viewer.statistics().liveLatencyMs).toBe(140);
});

test("limb of a live performer is overlaid", async () => {
  await openLiveViewer();
  FakeWebSocket.last.receive(live(0, 1, one));
  const limbs = new Map([[4, Int16Array.of(16_384, 0, 0, 0, 0, 0, 0, 0, 0)]]);
  FakeWebSocket.last.receive({ name: "Overlay", sequence: 0, due: EPOCH_US, limbs, earlier: [] });
  const pose = viewer.poseAt(now, 1)!;
  expect(2 * Math.atan2(pose.rotations[49], pose.rotations[48])).toBeCloseTo(Math.PI / 2, 3);
  const expected = livePose(1, one, 0);
  expectNear(pose.root, expected.root);
  expectNear(pose.rotations.subarray(0, 48), expected.rotations.subarray(0, 48));
});

test("live poses are dropped when the motion changes", async () => {
  await openLiveViewer();
  FakeWebSocket.last.receive(live(0, 1, one));
  expect(viewer.poseAt(now, 1)).not.toBeNull();
  expect(viewer.statistics().liveLatencyMs).toBe(60);
  FakeWebSocket.last.receive(header("other"), description("other"), timeline({ motion: "other", epoch: 2 }));
  expect(viewer.poseAt(now, 1)).toBeNull();
  expect(viewer.statistics().liveLatencyMs).toBeNull();
  // the same motion once more: they stay
  FakeWebSocket.last.receive(live(0, 1, one), description("other"));
  expectPose(viewer.poseAt(now, 1), livePose(1, one, 0));
});

test("late live messages delay the presentation as overlays do", async () => {
  await openLiveViewer();
  FakeWebSocket.last.receive({ name: "Pong", sequence: 0, sent: 0, received: EPOCH_US, answered: EPOCH_US });
  for (let nth = 0; nth < 150; nth++) {
    // the first of two frames is needed 33 ms before the last is due; both arrive 50 ms late
    FakeWebSocket.last.receive(live(now * 1000 - 50_000 + 2 * 16_667, 2, two));
    advanceTime(100 / 3);
  }
  const { playoutDelayMs, liveLatencyMs, latencyMs } = viewer.statistics();
  expect(playoutDelayMs).toBeCloseTo(60, 2);
  expect(liveLatencyMs).toBeCloseTo(120, 2);
  expect(latencyMs).toBeCloseTo(16.7, 0);
});

describe("invalid input", () => {
  test("damaged blocks and messages are skipped and counted, and others of the message are used", async () => {
    await openLiveViewer();
    for (const { frames, block } of golden.invalid) {
      const valid = golden.valid.find((vector) => vector.frames === frames)!;
      const blocks = new Map(
        [block, valid.block].map((data, performer) => [performer, { ageUs: 0, data: decodeBase64(data) }]),
      );
      FakeWebSocket.last.receive({ name: "Live", due: EPOCH_US, frames, blocks });
    }
    expect(viewer.damagedCount).toBe(golden.invalid.length);
    expect([viewer.poseAt(now, 0), viewer.poseAt(now, 1) === null]).toEqual([null, false]);
    FakeWebSocket.last.receiveRaw(pack(live(0, 2, two)).subarray(0, 20));
    expect(viewer.damagedCount).toBe(golden.invalid.length + 1);
    FakeWebSocket.last.receive(live(0, 2, two, 0));
    expect(viewer.poseAt(now, 0)).not.toBeNull();
  });

  test("performers that are not described are skipped", async () => {
    createViewer();
    FakeWebSocket.last.accept();
    await loadDecoder();
    FakeWebSocket.last.receive(header(), description(), timeline(), live(0, 2, two, 3), {
      name: "Live",
      due: EPOCH_US,
      frames: 2,
      blocks: new Map(),
    });
    expect([viewer.damagedCount, viewer.poseAt(now, 1)]).toEqual([0, null]);
  });
});

test("clock samples and live messages together keep the stage running", async () => {
  await openLiveViewer();
  for (let nth = 0; nth < 60; nth++) {
    FakeWebSocket.last.receive(live(now * 1000 + 40_000, 2, two));
    advanceTimeAnswered(100 / 3);
    if (nth > 3) expect(viewer.poseAt(now, 1)).not.toBeNull();
  }
  expect(viewer.statistics().playoutDelayMs).toBeLessThan(60);
});
