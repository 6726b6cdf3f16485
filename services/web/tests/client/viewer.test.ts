import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import { Viewer, type ViewerStatistics } from "../../src/client/viewer";
import { decodeMotionBlock } from "../../src/codec/motion-decoder";
import { restPose } from "../../src/motion/skeleton";
import type { Message, TimelineState } from "../../src/wire/messages";
import type { Overlay } from "../../src/wire/overlay";
import { type BlockVectors, goldenDescription, goldenTrack } from "../golden-motion";
import { goldenCameraBlocks, goldenCameraNumbers, goldenScene } from "../golden-scenes";
import { decodeBase64, loadVectors } from "../golden-vectors";
import { FakeWebSocket } from "./fake-websocket";

const UNIX = 1_774_000_000_000_000;
const SESSION = "ws://stage/v1/sessions/s1/stream";
const MOTION = "ws://stage/v1/motions/dance/stream?rate=1";
const golden = loadVectors<BlockVectors>("blocks").valid;
const [best, lowest, , last] = golden.map((vector) => decodeBase64(vector.block));

let now = 0;
/** Questions for the time that were answered. */
let answered = 0;
let viewer: Viewer;

beforeEach(() => {
  FakeWebSocket.install();
  now = answered = 0;
});
afterEach(() => {
  viewer.close();
  FakeWebSocket.remove();
});

/** `ms` pass on both clocks of this end. */
function advanceTime(ms: number): void {
  now += ms;
  vi.advanceTimersByTime(ms);
}

function header(motion = "dance"): Message {
  return {
    name: "ChannelHeader",
    motion,
    now: UNIX + now * 1000,
    channels: 19,
    software: "0",
    version: 1,
    clock: "unix",
  };
}

function description(motion = "dance"): Message {
  return { name: "Description", motion, first: null, tracks: [{ type: "song" }, goldenDescription()] };
}

function timeline(change: Partial<TimelineState> = {}): Message {
  return {
    name: "TimelineState",
    epoch: 1,
    motion: "dance",
    clock: UNIX,
    position: 0,
    playing: true,
    loop: true,
    duration: 2_600_000,
    ...change,
  };
}

function data(index: number, rate: number, block: Uint8Array): Message {
  return { name: "Data", track: 1, rate, index, block };
}

/** `ms` pass, and the server answers each question after 40 ms at the latest. */
function advanceTimeAnswered(ms: number): void {
  for (const end = now + ms; now < end; ) {
    advanceTime(Math.min(20, end - now));
    for (const { sequence, sent } of FakeWebSocket.last.messagesOf("Ping")) {
      if (sequence < answered || now * 1000 - sent < 40_000) continue;
      answered = sequence + 1;
      FakeWebSocket.last.receive({
        name: "Pong",
        sequence,
        sent,
        received: UNIX + sent + 20_000,
        answered: UNIX + sent + 20_000,
      });
    }
  }
}

/** A viewer whose server has greeted it, described the dance, and started it now. */
function openViewer(url = SESSION): Viewer {
  viewer = new Viewer({ url, now: () => now, solver: null });
  FakeWebSocket.last.accept();
  FakeWebSocket.last.receive(header(), description(), timeline());
  return viewer;
}

function expectNear(got: Float64Array, wanted: Float64Array): void {
  wanted.forEach((value, i) => expect(Math.abs(got[i] - value)).toBeLessThan(1e-9));
}

describe("the start", () => {
  test("nothing is known before the server speaks", () => {
    viewer = new Viewer({ url: SESSION, now: () => now, solver: null });
    expect(viewer.poseAt(0)).toBeNull();
    expect([viewer.figure, viewer.timeline, viewer.presence, viewer.motion]).toEqual([null, null, null, null]);
    expect([viewer.duration, viewer.blocks.length, viewer.ladder.length]).toEqual([0, 0, 0]);
    expect(viewer.statistics().reason).toBe("waiting for the first block");
  });

  test("each thing is told as it comes, and the first block is drawn without waiting for a clock answer", () => {
    viewer = new Viewer({ url: SESSION, now: () => now, solver: null });
    const told: string[] = [];
    for (const event of ["open", "figure", "timeline", "blocks", "presence"]) {
      viewer.addEventListener(event, () => told.push(event));
    }
    advanceTime(80);
    FakeWebSocket.last.accept();
    FakeWebSocket.last.receive(header(), description(), timeline({ clock: UNIX + 80_000 }));
    FakeWebSocket.last.receive({
      name: "Presence",
      viewers: 1,
      puppeteers: [],
      limbs: [null, null, null, null],
      asks: [[], [], [], []],
    });
    expect(viewer.poseAt(now)).toBeNull();
    FakeWebSocket.last.receive(data(0, 0, lowest));
    expect(told).toEqual(["open", "figure", "blocks", "timeline", "presence", "blocks"]);
    const wanted = restPose();
    decodeMotionBlock(goldenTrack(), lowest).poseAt(0, wanted);
    const pose = viewer.poseAt(now)!;
    expectNear(pose.root, wanted.root);
    expectNear(pose.rotations, wanted.rotations);
    expect(viewer.statistics().firstPoseMs).toBe(80);
    expect(viewer.duration).toBe(2.6);
    expect([...viewer.blocks]).toEqual([0, -1, -1]);
    expect(viewer.ladder[1]).toEqual({ kbps: 5, mean: 1, max: 4 });
  });
});

test("the pose goes on with time, and a better block takes over", () => {
  openViewer();
  FakeWebSocket.last.receive(data(0, 0, lowest));
  advanceTime(500);
  const wanted = restPose();
  decodeMotionBlock(goldenTrack(), lowest).poseAt(15, wanted);
  expectNear(viewer.poseAt(now)!.rotations, wanted.rotations);
  expect(viewer.positionAt(now)).toBeCloseTo(0.5, 9);
  expect(viewer.statistics().rate).toBe(0);
  // what is told of is what was chosen, whatever the block on show still is
  FakeWebSocket.last.receive({ name: "Choice", rate: 1, reason: "best", line: null });
  expect(viewer.statistics().rate).toBe(1);
  FakeWebSocket.last.receive(data(0, 1, best));
  decodeMotionBlock(goldenTrack(), best).poseAt(15, wanted);
  expectNear(viewer.poseAt(now)!.rotations, wanted.rotations);
  expect(viewer.statistics().rate).toBe(1);
});

test("where the block needed is missing the pose holds still, and that is one gap", () => {
  openViewer();
  FakeWebSocket.last.receive(data(0, 1, best));
  advanceTime(990);
  const held = structuredClone(viewer.poseAt(now)!);
  advanceTime(50);
  expect(viewer.poseAt(now)).toEqual(held);
  advanceTime(50);
  viewer.poseAt(now);
  let line: ViewerStatistics = viewer.statistics();
  expect([line.gaps, line.bufferSeconds, line.reason]).toEqual([1, 0, "waiting for a block"]);
  FakeWebSocket.last.receive(data(1, 0, lowest));
  expect(viewer.poseAt(now)).not.toEqual(held);
  line = viewer.statistics();
  expect([line.gaps, line.reason]).toEqual([1, "chosen by the server"]);
  expect(line.bufferSeconds).toBeCloseTo(0.91, 9);
});

test("overlays lie over the dance on clock time, and their lateness is measured", () => {
  openViewer();
  FakeWebSocket.last.receive(data(0, 1, best));
  const overlay = (due: number, x: number): Overlay => ({
    name: "Overlay",
    sequence: 0,
    due: UNIX + due,
    limbs: new Map([[0, Int16Array.of(x, 0, 0, 0, 0, 0, 0, 0, 0)]]),
    earlier: [],
  });
  FakeWebSocket.last.receive(overlay(100_000, 0), overlay(200_000, 16384));
  expect(viewer.statistics().latencyMs).toBeLessThan(-100);
  advanceTime(150);
  const pose = viewer.poseAt(now)!;
  expect(2 * Math.atan2(pose.rotations[49], pose.rotations[48])).toBeCloseTo(Math.PI / 4, 4);
  const wanted = restPose();
  decodeMotionBlock(goldenTrack(), best).poseAt(4.5, wanted);
  expectNear(pose.rotations.subarray(60), wanted.rotations.subarray(60));
  advanceTime(400);
  decodeMotionBlock(goldenTrack(), best).poseAt(16.5, wanted);
  expectNear(viewer.poseAt(now)!.rotations, wanted.rotations);
});

test("overlays that come late are shown as much later, and the dance with them", () => {
  openViewer();
  FakeWebSocket.last.receive(data(0, 1, best));
  FakeWebSocket.last.receive({ name: "Pong", sequence: 0, sent: 0, received: UNIX, answered: UNIX });
  const limbs = new Map([[0, new Int16Array(9)]]);
  for (let nth = 0; nth < 150; nth++) {
    // the first of two frames is needed 33 ms before the last is due: both come 50 ms too late
    const due = UNIX + now * 1000 - 50_000 + 2 * 16_667;
    FakeWebSocket.last.receive({ name: "Overlay", sequence: nth, due, limbs, earlier: [limbs] });
    advanceTime(100 / 3);
    expect((viewer.presentationTime(now) - UNIX) / 1e6 + viewer.statistics().playoutDelayMs / 1000).toBeCloseTo(
      now / 1000,
      6,
    );
    expect(viewer.positionAt(now)).toBeCloseTo(((viewer.presentationTime(now) - UNIX) / 1e6) % 2.6, 6);
  }
  expect(viewer.statistics().playoutDelayMs).toBeCloseTo(60, 2);
  expect(viewer.presentationTime(now)).toBeCloseTo(viewer.clockTime(now)! - 60_000, -1);
});

test("pings in a burst, then every two seconds, and takes the smallest round trip", () => {
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
  expect(viewer.clockTime(now)).toBeCloseTo(UNIX + now * 1000, -1);
});

test("reports once a second what is ready and how long drawing takes", () => {
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

describe("camera and light", () => {
  const filmed = (): Message => ({
    name: "Description",
    motion: "filmed",
    first: null,
    tracks: [goldenScene(1), goldenDescription(), goldenScene(0)],
  });
  const cameraData = (index: number, rate: number): Message => ({
    name: "Data",
    track: 2,
    rate,
    index,
    block: goldenCameraBlocks[rate][index],
  });

  test("are shown beside the dance at the same instant", () => {
    openViewer();
    FakeWebSocket.last.receive(header("filmed"), filmed(), timeline({ epoch: 2, motion: "filmed" }));
    expect(viewer.scenes.map(({ kind }) => kind)).toEqual(["light", "camera"]);
    expect(viewer.cameraAt(now)).toBeNull();
    FakeWebSocket.last.receive(cameraData(0, 0), cameraData(0, 1), cameraData(1, 1), data(0, 1, best));
    expect([viewer.damagedCount, ...viewer.blocks]).toEqual([0, 1, -1, -1]);
    expectNear(viewer.cameraAt(now)!, Float64Array.from(goldenCameraNumbers(0)[0]));
    expect(viewer.sceneAt(now, 1)).toEqual(viewer.cameraAt(now));
    expect([viewer.sceneAt(now, 0), viewer.sceneAt(now, 2)]).toEqual([null, null]);
    expect(viewer.poseAt(now)).not.toBeNull();
    now = (26 / 30) * 1000;
    viewer.cameraAt(now)!.forEach((value, i) => expect(value).toBeCloseTo(goldenCameraNumbers(1)[0][i], 6));
  });

  test("may be told of after the dance, and are shown from then on", () => {
    openViewer();
    const told: string[] = [];
    for (const event of ["figure", "tracks"]) viewer.addEventListener(event, () => told.push(event));
    const rest = (first: number, motion = "filmed"): Message => ({
      name: "Description",
      motion,
      first,
      tracks: [goldenScene(1), goldenScene(0)],
    });
    FakeWebSocket.last.receive(header("filmed"), rest(1), { ...filmed(), tracks: [goldenDescription()] } as Message);
    FakeWebSocket.last.receive(timeline({ epoch: 2, motion: "filmed" }), cameraData(0, 1));
    expect([viewer.cameraAt(now), viewer.scenes.length]).toEqual([null, 0]);
    FakeWebSocket.last.receive(rest(1, "another"), rest(1), rest(1), cameraData(0, 1));
    expect(viewer.scenes.map(({ kind }) => kind)).toEqual(["light", "camera"]);
    expectNear(viewer.cameraAt(now)!, Float64Array.from(goldenCameraNumbers(0)[0]));
    expect(told).toEqual(["figure", "tracks"]);
  });

  test("belong to their motion", () => {
    openViewer();
    FakeWebSocket.last.receive(header("filmed"), filmed(), timeline({ epoch: 2, motion: "filmed" }), cameraData(0, 1));
    expect(viewer.cameraAt(now)).not.toBeNull();
    FakeWebSocket.last.receive(header(), description());
    expect([viewer.cameraAt(now), viewer.scenes.length]).toEqual([null, 0]);
    FakeWebSocket.last.receive(timeline({ epoch: 3 }));
    expect(viewer.cameraAt(now)).toBeNull();
  });

  test("that are damaged are counted as such", () => {
    openViewer();
    FakeWebSocket.last.receive(header("filmed"), filmed(), timeline({ epoch: 2, motion: "filmed" }));
    FakeWebSocket.last.receive({ name: "Data", track: 2, rate: 0, index: 0, block: best.subarray(0, 0) });
    FakeWebSocket.last.receive({ name: "Data", track: 2, rate: 0, index: 9, block: goldenCameraBlocks[0][0] });
    expect(viewer.damagedCount).toBe(2);
  });
});

describe("when the line is lost", () => {
  test("it comes back, keeps its blocks and the dance goes on meanwhile", () => {
    openViewer();
    const reasons: string[] = [];
    viewer.addEventListener("closed", (event) => reasons.push((event as CustomEvent<string>).detail));
    FakeWebSocket.last.receive(data(0, 1, best));
    FakeWebSocket.last.endWith(1006);
    expect(viewer.statistics().reason).toBe("the connection was lost");
    advanceTime(250);
    expect(viewer.positionAt(now)).toBeCloseTo(0.25, 9);
    expect(viewer.poseAt(now)).not.toBeNull();
    FakeWebSocket.last.accept();
    FakeWebSocket.last.receive(header(), description(), timeline({ epoch: 1, position: 100_000 }));
    expect([...viewer.blocks]).toEqual([1, -1, -1]);
    expect(viewer.positionAt(now)).toBeCloseTo(0.35, 9);
    expect(reasons).toEqual(["the connection was lost"]);
    expect(viewer.isClosed).toBe(false);
  });

  test("another motion drops the blocks", () => {
    openViewer();
    FakeWebSocket.last.receive(data(0, 1, best));
    FakeWebSocket.last.receive(header("other"), description("other"));
    expect(viewer.poseAt(now)).toBeNull();
    expect([...viewer.blocks]).toEqual([-1, -1, -1]);
    FakeWebSocket.last.receive(timeline({ epoch: 2, motion: "other" }), data(0, 0, lowest));
    expect(viewer.poseAt(now)).not.toBeNull();
    expect(viewer.motion).toBe("other");
  });

  test("a private timeline goes on from where it stood", () => {
    openViewer(MOTION);
    FakeWebSocket.last.receive(data(0, 1, best));
    advanceTime(400);
    FakeWebSocket.last.receive(timeline({ epoch: 2, clock: UNIX, position: 700_000, playing: false, loop: false }));
    FakeWebSocket.last.endWith(1006);
    advanceTime(250);
    const clock = UNIX + 650_000;
    expect(FakeWebSocket.last.url).toBe(
      `ws://stage/v1/motions/dance/stream?rate=1&have=dance.0.1--.2&at=0.700000&clock=${clock}`,
    );
    FakeWebSocket.last.accept();
    FakeWebSocket.last.receive(header(), description(), timeline({ position: 700_000 }));
    expect(FakeWebSocket.last.messagesOf("Edit")).toEqual([
      { name: "Edit", playing: false, position: null, loop: false },
    ]);
  });

  test("what is held is not asked for again, in a session either", () => {
    openViewer();
    FakeWebSocket.last.receive(data(0, 1, best));
    FakeWebSocket.last.endWith(1006);
    advanceTime(250);
    expect(new URL(FakeWebSocket.last.url).searchParams.get("have")).toBe("dance.0.1--.2");
    expect(new URL(FakeWebSocket.last.url).searchParams.has("at")).toBe(false);
  });

  test("a line that falls silent is replaced by another, where the dance goes on as it was", () => {
    openViewer(MOTION);
    FakeWebSocket.last.receive(
      data(0, 1, best),
      timeline({ epoch: 2, clock: UNIX, position: 700_000, playing: false, loop: false }),
    );
    const told: string[] = [];
    for (const event of ["open", "replaced", "closed"]) viewer.addEventListener(event, () => told.push(event));
    const silent = FakeWebSocket.last;
    // it is asked for the time now and then, and does not answer
    advanceTime(6_500);
    expect(FakeWebSocket.opened.length).toBeGreaterThan(1);
    expect(FakeWebSocket.last.url).toContain("have=dance.0.1--.2&at=0.700000");
    FakeWebSocket.last.accept();
    expect([told, silent.readyState]).toEqual([[], 1]);
    FakeWebSocket.last.receive(header(), description(), timeline({ position: 700_000 }));
    expect([told, silent.readyState]).toEqual([["open", "replaced"], 3]);
    expect(FakeWebSocket.last.messagesOf("Edit")).toEqual([
      { name: "Edit", playing: false, position: null, loop: false },
    ]);
    expect(FakeWebSocket.last.messagesOf("Ping")).toHaveLength(1);
    expect([...viewer.blocks]).toEqual([1, -1, -1]);
  });

  test("a missing session is the end", () => {
    openViewer();
    FakeWebSocket.last.endWith(4404);
    advanceTime(60_000);
    expect(FakeWebSocket.opened).toHaveLength(1);
    expect(viewer.isClosed).toBe(true);
    expect(viewer.statistics().reason).toBe("there is no such motion or session");
  });
});

describe("what cannot be played", () => {
  test("a damaged block is passed over and counted", () => {
    openViewer();
    FakeWebSocket.last.receive(data(0, 1, best.subarray(0, 0)), data(0, 1, last), data(3, 0, best));
    FakeWebSocket.last.receiveRaw(Uint8Array.of(4, 0xc1));
    expect(viewer.damagedCount).toBe(4);
    expect([...viewer.blocks]).toEqual([-1, -1, -1]);
    FakeWebSocket.last.receive(data(0, 0, lowest));
    expect(viewer.poseAt(now)).not.toBeNull();
  });

  test("other tracks' data is skipped", () => {
    openViewer();
    FakeWebSocket.last.receive({ name: "Data", track: 0, rate: 1, index: 0, block: best });
    expect([viewer.damagedCount, ...viewer.blocks]).toEqual([0, -1, -1, -1]);
  });

  test.each([
    ["no motion", [{ type: "audio" }], "the stream has no motion in it"],
    [
      "another codec",
      [{ ...goldenDescription(), codec: "bunraku.motion/9" }],
      "Unsupported motion codec bunraku.motion/9",
    ],
    ["no frames", [{ ...goldenDescription(), frames: 0 }], "motion track: frames must"],
    [
      "a dancer cut short",
      [{ ...goldenDescription(), dancer: new Uint8Array(0) }],
      "Invalid skeleton description: 0 bytes",
    ],
    ["no rates", [{ ...goldenDescription(), rates: [] }], "motion track: rates must"],
    ["a rate of nothing", [{ ...goldenDescription(), rates: [null] }], "rate 0 must have kbps"],
  ])("%s ends it and says why", (_, tracks, why) => {
    viewer = new Viewer({ url: SESSION, now: () => now, solver: null });
    FakeWebSocket.last.accept();
    FakeWebSocket.last.receive(header(), { name: "Description", motion: "dance", first: null, tracks });
    expect(viewer.isClosed).toBe(true);
    expect(viewer.statistics().reason).toContain(why);
  });
});

test("a private timeline is edited in seconds", () => {
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
