/** Lost and silent connections of a viewer. */
import { describe, expect, test } from "vitest";
import { FakeWebSocket } from "./fake-websocket";
import {
  advanceTime,
  best,
  data,
  description,
  EPOCH_US,
  header,
  isolateViewers,
  lowest,
  MOTION,
  now,
  openViewer,
  timeline,
  viewer,
} from "./viewer-suite";

isolateViewers();

describe("lost connection", () => {
  test("is re-established; blocks and playback continue meanwhile", () => {
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

  test("blocks are dropped with the motion", () => {
    openViewer();
    FakeWebSocket.last.receive(data(0, 1, best));
    FakeWebSocket.last.receive(header("other"), description("other"));
    expect(viewer.poseAt(now)).toBeNull();
    expect([...viewer.blocks]).toEqual([-1, -1, -1]);
    FakeWebSocket.last.receive(timeline({ epoch: 2, motion: "other" }), data(0, 0, lowest));
    expect(viewer.poseAt(now)).not.toBeNull();
    expect(viewer.motion).toBe("other");
  });

  test("private timeline resumes at its position", () => {
    openViewer(MOTION);
    FakeWebSocket.last.receive(data(0, 1, best));
    advanceTime(400);
    FakeWebSocket.last.receive(timeline({ epoch: 2, clock: EPOCH_US, position: 700_000, playing: false, loop: false }));
    FakeWebSocket.last.endWith(1006);
    advanceTime(250);
    const clock = EPOCH_US + 650_000;
    expect(FakeWebSocket.last.url).toBe(
      `ws://stage/v1/motions/dance/stream?rate=1&extensions=true&parts=body%2Cfingers%2Cface%2Ccontacts%2Cprops&have=dance.0.1--.2&at=0.700000&clock=${clock}`,
    );
    FakeWebSocket.last.accept();
    FakeWebSocket.last.receive(header(), description(), timeline({ position: 700_000 }));
    expect(FakeWebSocket.last.messagesOf("Edit")).toEqual([
      { name: "Edit", playing: false, position: null, loop: false },
    ]);
  });

  test("held blocks are listed in a session, too", () => {
    openViewer();
    FakeWebSocket.last.receive(data(0, 1, best));
    FakeWebSocket.last.endWith(1006);
    advanceTime(250);
    expect(new URL(FakeWebSocket.last.url).searchParams.get("have")).toBe("dance.0.1--.2");
    expect(new URL(FakeWebSocket.last.url).searchParams.has("at")).toBe(false);
  });

  test("silent connection is replaced, and the private timeline resumes", () => {
    openViewer(MOTION);
    FakeWebSocket.last.receive(
      data(0, 1, best),
      timeline({ epoch: 2, clock: EPOCH_US, position: 700_000, playing: false, loop: false }),
    );
    const events: string[] = [];
    for (const event of ["open", "replaced", "closed"]) viewer.addEventListener(event, () => events.push(event));
    const silent = FakeWebSocket.last;
    // the pings are not answered
    advanceTime(6_500);
    expect(FakeWebSocket.opened.length).toBeGreaterThan(1);
    expect(FakeWebSocket.last.url).toContain("have=dance.0.1--.2&at=0.700000");
    FakeWebSocket.last.accept();
    expect([events, silent.readyState]).toEqual([[], 1]);
    FakeWebSocket.last.receive(header(), description(), timeline({ position: 700_000 }));
    expect([events, silent.readyState]).toEqual([["open", "replaced"], 3]);
    expect(FakeWebSocket.last.messagesOf("Edit")).toEqual([
      { name: "Edit", playing: false, position: null, loop: false },
    ]);
    expect(FakeWebSocket.last.messagesOf("Ping")).toHaveLength(1);
    expect([...viewer.blocks]).toEqual([1, -1, -1]);
  });

  test("missing session is final", () => {
    openViewer();
    FakeWebSocket.last.endWith(4404);
    advanceTime(60_000);
    expect(FakeWebSocket.opened).toHaveLength(1);
    expect(viewer.isClosed).toBe(true);
    expect(viewer.statistics().reason).toBe("there is no such motion or session");
  });
});
