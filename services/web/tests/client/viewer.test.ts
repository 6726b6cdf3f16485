import { describe, expect, test } from "vitest";
import type { ViewerStatistics } from "../../src/client/viewer";
import { decodeMotionBlock } from "../../src/codec/motion-decoder";
import { restPose } from "../../src/motion/skeleton";
import type { Overlay } from "../../src/wire/overlay";
import { goldenDescription, goldenTrack } from "../golden-motion";
import { FakeWebSocket } from "./fake-websocket";
import {
  advanceTime,
  advanceTimeAnswered,
  best,
  createViewer,
  data,
  description,
  EPOCH_US,
  expectNear,
  header,
  isolateViewers,
  last,
  lowest,
  MOTION,
  now,
  openViewer,
  timeline,
  viewer,
} from "./viewer-suite";

isolateViewers();

describe("crowd", () => {
  test("pull is sent, and the pulls of a limb are known until nobody pulls", () => {
    createViewer();
    expect(viewer.pull(1, 0.5)).toBe(false);
    FakeWebSocket.last.accept();
    expect(viewer.pull(1, 0.5, -0.25, 0.125)).toBe(true);
    expect(FakeWebSocket.last.sent.filter(({ name }) => name === "Pull")).toEqual([
      { name: "Pull", limb: 1, place: [0.5, -0.25, 0.125] },
    ]);
    let changes = 0;
    viewer.addEventListener("pulls", () => changes++);
    const pulls = { name: "CrowdPulls", limb: 1, count: 2, places: [[0.5, 0, 0]], votes: null } as const;
    FakeWebSocket.last.receive({ ...pulls, places: [[0.5, 0, 0]] });
    expect(viewer.crowdPulls.get(1)).toEqual(pulls);
    FakeWebSocket.last.receive({ name: "CrowdPulls", limb: 1, count: 0, places: [], votes: null });
    expect([viewer.crowdPulls.size, changes]).toEqual([0, 2]);
  });

  test("turns of this viewer are known until they end or the connection is lost", () => {
    createViewer();
    FakeWebSocket.last.accept();
    FakeWebSocket.last.receive({ name: "CrowdTurn", limb: 1, yours: true });
    FakeWebSocket.last.receive({ name: "CrowdTurn", limb: 5, yours: true });
    FakeWebSocket.last.receive({ name: "CrowdTurn", limb: 1, yours: false });
    expect([...viewer.crowdTurns]).toEqual([5]);
    FakeWebSocket.last.endWith(1006);
    advanceTime(250);
    FakeWebSocket.last.accept();
    expect(viewer.crowdTurns.size).toBe(0);
  });
});

describe("props", () => {
  test("are those of the session before those of the motion", () => {
    createViewer();
    expect(viewer.propsAt(0)).toEqual([]);
    FakeWebSocket.last.accept();
    const props = [{ prop: 3, kind: "fan", limb: 1, place: [0.5, 1, 0.25] }];
    FakeWebSocket.last.receive({
      name: "Presence",
      viewers: 1,
      puppeteers: [],
      limbs: [null, null, null, null],
      asks: [[], [], [], []],
      live: null,
      bonds: null,
      crowd: null,
      props,
    });
    expect(viewer.propsAt(0)).toEqual(props);
  });
});

describe("start", () => {
  test("state is empty before the first message", () => {
    createViewer();
    expect(viewer.poseAt(0)).toBeNull();
    expect([viewer.figure, viewer.timeline, viewer.presence, viewer.motion]).toEqual([null, null, null, null]);
    expect([viewer.duration, viewer.blocks.length, viewer.ladder.length]).toEqual([0, 0, 0]);
    expect(viewer.statistics().reason).toBe("waiting for the first block");
  });

  test("events are dispatched, and the first block is shown before a clock sample", () => {
    createViewer();
    const events: string[] = [];
    for (const event of ["open", "figure", "timeline", "blocks", "presence"]) {
      viewer.addEventListener(event, () => events.push(event));
    }
    advanceTime(80);
    FakeWebSocket.last.accept();
    FakeWebSocket.last.receive(header(), description(), timeline({ clock: EPOCH_US + 80_000 }));
    FakeWebSocket.last.receive({
      name: "Presence",
      live: null,
      bonds: null,
      crowd: null,
      props: null,
      viewers: 1,
      puppeteers: [],
      limbs: [null, null, null, null],
      asks: [[], [], [], []],
    });
    expect(viewer.poseAt(now)).toBeNull();
    FakeWebSocket.last.receive(data(0, 0, lowest));
    expect(events).toEqual(["open", "figure", "blocks", "timeline", "presence", "blocks"]);
    const expected = restPose();
    decodeMotionBlock(goldenTrack(), lowest).poseAt(0, expected);
    const pose = viewer.poseAt(now)!;
    expectNear(pose.root, expected.root);
    expectNear(pose.rotations, expected.rotations);
    expect(viewer.statistics().firstPoseMs).toBe(80);
    expect(viewer.duration).toBe(2.6);
    expect([...viewer.blocks]).toEqual([0, -1, -1]);
    expect(viewer.ladder[1]).toEqual({ kbps: 5, mean: 1, max: 4 });
  });
});

test("pose advances with time, and a higher level replaces a block", () => {
  openViewer();
  FakeWebSocket.last.receive(data(0, 0, lowest));
  advanceTime(500);
  const expected = restPose();
  decodeMotionBlock(goldenTrack(), lowest).poseAt(15, expected);
  expectNear(viewer.poseAt(now)!.rotations, expected.rotations);
  expect(viewer.positionAt(now)).toBeCloseTo(0.5, 9);
  expect(viewer.statistics().rate).toBe(0);
  // the choice counts, whatever the level of the current block
  FakeWebSocket.last.receive({ name: "Choice", rate: 1, reason: "best", line: null });
  expect(viewer.statistics().rate).toBe(1);
  FakeWebSocket.last.receive(data(0, 1, best));
  decodeMotionBlock(goldenTrack(), best).poseAt(15, expected);
  expectNear(viewer.poseAt(now)!.rotations, expected.rotations);
  expect(viewer.statistics().rate).toBe(1);
});

test("pose stays while a block is missing, and that is one gap", () => {
  openViewer();
  FakeWebSocket.last.receive(data(0, 1, best));
  advanceTime(990);
  const lastPose = structuredClone(viewer.poseAt(now)!);
  advanceTime(50);
  expect(viewer.poseAt(now)).toEqual(lastPose);
  advanceTime(50);
  viewer.poseAt(now);
  let statistics: ViewerStatistics = viewer.statistics();
  expect([statistics.gaps, statistics.bufferSeconds, statistics.reason]).toEqual([1, 0, "waiting for a block"]);
  FakeWebSocket.last.receive(data(1, 0, lowest));
  expect(viewer.poseAt(now)).not.toEqual(lastPose);
  statistics = viewer.statistics();
  expect([statistics.gaps, statistics.reason]).toEqual([1, "chosen by the server"]);
  expect(statistics.bufferSeconds).toBeCloseTo(0.91, 9);
});

test("overlays apply at their clock time, and their lateness is measured", () => {
  openViewer();
  FakeWebSocket.last.receive(data(0, 1, best));
  const overlay = (due: number, x: number): Overlay => ({
    name: "Overlay",
    sequence: 0,
    due: EPOCH_US + due,
    limbs: new Map([[0, Int16Array.of(x, 0, 0, 0, 0, 0, 0, 0, 0)]]),
    earlier: [],
  });
  FakeWebSocket.last.receive(overlay(100_000, 0), overlay(200_000, 16384));
  expect(viewer.statistics().latencyMs).toBeLessThan(-100);
  advanceTime(150);
  const pose = viewer.poseAt(now)!;
  expect(2 * Math.atan2(pose.rotations[49], pose.rotations[48])).toBeCloseTo(Math.PI / 4, 4);
  const expected = restPose();
  decodeMotionBlock(goldenTrack(), best).poseAt(4.5, expected);
  expectNear(pose.rotations.subarray(60), expected.rotations.subarray(60));
  advanceTime(400);
  decodeMotionBlock(goldenTrack(), best).poseAt(16.5, expected);
  expectNear(viewer.poseAt(now)!.rotations, expected.rotations);
});

test("late overlays delay the presentation", () => {
  openViewer();
  FakeWebSocket.last.receive(data(0, 1, best));
  FakeWebSocket.last.receive({ name: "Pong", sequence: 0, sent: 0, received: EPOCH_US, answered: EPOCH_US });
  const limbs = new Map([[0, new Int16Array(9)]]);
  for (let nth = 0; nth < 150; nth++) {
    // the first of two frames is needed 33 ms before the last is due; both arrive 50 ms late
    const due = EPOCH_US + now * 1000 - 50_000 + 2 * 16_667;
    FakeWebSocket.last.receive({ name: "Overlay", sequence: nth, due, limbs, earlier: [limbs] });
    advanceTime(100 / 3);
    expect((viewer.presentationTime(now) - EPOCH_US) / 1e6 + viewer.statistics().playoutDelayMs / 1000).toBeCloseTo(
      now / 1000,
      6,
    );
    expect(viewer.positionAt(now)).toBeCloseTo(((viewer.presentationTime(now) - EPOCH_US) / 1e6) % 2.6, 6);
  }
  expect(viewer.statistics().playoutDelayMs).toBeCloseTo(60, 2);
  expect(viewer.presentationTime(now)).toBeCloseTo(viewer.clockTime(now)! - 60_000, -1);
});

test("pings in a burst, then every 2 s, and uses the smallest round trip", () => {
  openViewer();
  advanceTimeAnswered(60 * 7);
  expect(FakeWebSocket.last.messagesOf("Ping")).toHaveLength(8);
  advanceTimeAnswered(1_999);
  expect(FakeWebSocket.last.messagesOf("Ping")).toHaveLength(8);
  advanceTimeAnswered(1);
  const pings = FakeWebSocket.last.messagesOf("Ping");
  expect(pings).toHaveLength(9);
  expect(new Set(pings.map((ping) => ping.sequence)).size).toBe(9);
  advanceTimeAnswered(40);
  expect(viewer.statistics().clockErrorMs).toBe(20);
  expect(viewer.clockTime(now)).toBeCloseTo(EPOCH_US + now * 1000, -1);
});

test("reports buffer and drawing time once per second", () => {
  openViewer();
  FakeWebSocket.last.receive(data(0, 1, best), data(1, 0, lowest));
  for (let frame = 0; frame < 200; frame++) viewer.recordFrame(8);
  advanceTimeAnswered(1_000);
  const [report] = FakeWebSocket.last.messagesOf("Report");
  expect(report.buffer).toBe(1_000_000);
  expect(report.frame).toBeCloseTo(8_000, -1);
  expect(report.hidden).toBe(false);
  advanceTimeAnswered(2_000);
  expect(FakeWebSocket.last.messagesOf("Report")).toHaveLength(3);
});

describe("invalid input", () => {
  test("damaged block is skipped and counted", () => {
    openViewer();
    FakeWebSocket.last.receive(data(0, 1, best.subarray(0, 0)), data(0, 1, last), data(3, 0, best));
    FakeWebSocket.last.receiveRaw(Uint8Array.of(4, 0xc1));
    expect(viewer.damagedCount).toBe(4);
    expect([...viewer.blocks]).toEqual([-1, -1, -1]);
    FakeWebSocket.last.receive(data(0, 0, lowest));
    expect(viewer.poseAt(now)).not.toBeNull();
  });

  test("data of unknown tracks is skipped", () => {
    openViewer();
    FakeWebSocket.last.receive({ name: "Data", track: 0, rate: 1, index: 0, block: best });
    expect([viewer.damagedCount, ...viewer.blocks]).toEqual([0, -1, -1, -1]);
  });

  test.each([
    ["no motion", [{ type: "audio" }], "The stream has no motion track"],
    [
      "another codec",
      [{ ...goldenDescription(), codec: "bunraku.motion/9" }],
      "Unsupported motion codec bunraku.motion/9",
    ],
    ["no frames", [{ ...goldenDescription(), frames: 0 }], "motion track: frames must"],
    [
      "a truncated skeleton",
      [{ ...goldenDescription(), dancer: new Uint8Array(0) }],
      "Invalid skeleton description: 0 bytes",
    ],
    ["no levels", [{ ...goldenDescription(), rates: [] }], "motion track: rates must"],
    ["an empty level", [{ ...goldenDescription(), rates: [null] }], "rate 0 must have kbps"],
  ])("%s closes the connection with the reason", (_, tracks, why) => {
    createViewer();
    FakeWebSocket.last.accept();
    FakeWebSocket.last.receive(header(), { name: "Description", motion: "dance", first: null, tracks });
    expect(viewer.isClosed).toBe(true);
    expect(viewer.statistics().reason).toContain(why);
  });
});

test("private timeline is edited in seconds", () => {
  openViewer(MOTION);
  expect(viewer.edit({ position: 1.25, playing: false })).toBe(true);
  expect(FakeWebSocket.last.messagesOf("Edit")).toEqual([
    { name: "Edit", playing: false, position: 1_250_000, loop: null },
  ]);
  expect(viewer.statistics().reason).toBe("waiting for the first block");
  FakeWebSocket.last.receive(data(0, 1, best));
  viewer.poseAt(now);
  expect(viewer.statistics().reason).toBe("pinned by the address");
});
