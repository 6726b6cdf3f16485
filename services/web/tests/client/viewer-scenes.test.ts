/** Camera and light tracks of a viewer's motion. */
import { describe, expect, test } from "vitest";
import type { Message } from "../../src/wire/messages";
import { goldenDescription } from "../golden-motion";
import { goldenCameraBlocks, goldenCameraNumbers, goldenScene } from "../golden-scenes";
import { FakeWebSocket } from "./fake-websocket";
import {
  advanceTime,
  best,
  data,
  description,
  expectNear,
  header,
  isolateViewers,
  now,
  openViewer,
  timeline,
  viewer,
} from "./viewer-suite";

isolateViewers();

describe("camera and light", () => {
  const filmedDescription = (): Message => ({
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

  test("have the position of the motion", () => {
    openViewer();
    FakeWebSocket.last.receive(header("filmed"), filmedDescription(), timeline({ epoch: 2, motion: "filmed" }));
    expect(viewer.scenes.map(({ kind }) => kind)).toEqual(["light", "camera"]);
    expect(viewer.cameraAt(now)).toBeNull();
    FakeWebSocket.last.receive(cameraData(0, 0), cameraData(0, 1), cameraData(1, 1), data(0, 1, best));
    expect([viewer.damagedCount, ...viewer.blocks]).toEqual([0, 1, -1, -1]);
    expectNear(viewer.cameraAt(now)!, Float64Array.from(goldenCameraNumbers(0)[0]));
    expect(viewer.sceneAt(now, 1)).toEqual(viewer.cameraAt(now));
    expect([viewer.sceneAt(now, 0), viewer.sceneAt(now, 2)]).toEqual([null, null]);
    expect(viewer.poseAt(now)).not.toBeNull();
    advanceTime((26 / 30) * 1000);
    viewer.cameraAt(now)!.forEach((value, i) => expect(value).toBeCloseTo(goldenCameraNumbers(1)[0][i], 6));
  });

  test("may be described after the motion", () => {
    openViewer();
    const events: string[] = [];
    for (const event of ["figure", "tracks"]) viewer.addEventListener(event, () => events.push(event));
    const furtherTracks = (first: number, motion = "filmed"): Message => ({
      name: "Description",
      motion,
      first,
      tracks: [goldenScene(1), goldenScene(0)],
    });
    FakeWebSocket.last.receive(header("filmed"), furtherTracks(1), {
      ...filmedDescription(),
      tracks: [goldenDescription()],
    } as Message);
    FakeWebSocket.last.receive(timeline({ epoch: 2, motion: "filmed" }), cameraData(0, 1));
    expect([viewer.cameraAt(now), viewer.scenes.length]).toEqual([null, 0]);
    FakeWebSocket.last.receive(furtherTracks(1, "another"), furtherTracks(1), furtherTracks(1), cameraData(0, 1));
    expect(viewer.scenes.map(({ kind }) => kind)).toEqual(["light", "camera"]);
    expectNear(viewer.cameraAt(now)!, Float64Array.from(goldenCameraNumbers(0)[0]));
    expect(events).toEqual(["figure", "tracks"]);
  });

  test("are dropped with their motion", () => {
    openViewer();
    FakeWebSocket.last.receive(
      header("filmed"),
      filmedDescription(),
      timeline({ epoch: 2, motion: "filmed" }),
      cameraData(0, 1),
    );
    expect(viewer.cameraAt(now)).not.toBeNull();
    FakeWebSocket.last.receive(header(), description());
    expect([viewer.cameraAt(now), viewer.scenes.length]).toEqual([null, 0]);
    FakeWebSocket.last.receive(timeline({ epoch: 3 }));
    expect(viewer.cameraAt(now)).toBeNull();
  });

  test("that are damaged are counted", () => {
    openViewer();
    FakeWebSocket.last.receive(header("filmed"), filmedDescription(), timeline({ epoch: 2, motion: "filmed" }));
    FakeWebSocket.last.receive({ name: "Data", track: 2, rate: 0, index: 0, block: best.subarray(0, 0) });
    FakeWebSocket.last.receive({ name: "Data", track: 2, rate: 0, index: 9, block: goldenCameraBlocks[0][0] });
    expect(viewer.damagedCount).toBe(2);
  });
});
