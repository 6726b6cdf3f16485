import { afterEach, beforeEach, expect, test, vi } from "vitest";
import type { Playback, PlaybackKind } from "../../src/app/playback";
import { restorePosition, savePosition } from "../../src/app/saved-position";
import { Viewer } from "../../src/client/viewer";
import { FakeWebSocket } from "../client/fake-websocket";
import { stubStorage } from "../storage/storage-stub";

const TIMELINE = {
  name: "TimelineState",
  motion: "m",
  epoch: 1,
  playing: false,
  position: 0,
  clock: 0,
  loop: true,
  duration: 30_000_000,
} as const;

let opened: Viewer[];

beforeEach(() => {
  opened = [];
  FakeWebSocket.install();
  stubStorage("sessionStorage");
});
afterEach(() => {
  for (const viewer of opened) viewer.close();
  FakeWebSocket.remove();
  vi.unstubAllGlobals();
});

/** Open a playback at position 12.5 s; return it with its connection. */
function openPlayback(id: string, kind: PlaybackKind): { playback: Playback; socket: FakeWebSocket } {
  const viewer = new Viewer({ url: `ws://stage/v1/${kind}/${id}/stream`, now: () => 0, solver: null });
  opened.push(viewer);
  const socket = FakeWebSocket.last;
  socket.accept();
  return { playback: { id, kind, viewer, position: () => 12.5 } as unknown as Playback, socket };
}

test("motion resumes at its saved position once", () => {
  const before = openPlayback("m", "motions");
  before.socket.receive(TIMELINE);
  savePosition(before.playback, 0);
  const after = openPlayback("m", "motions");
  restorePosition(after.playback);
  expect(after.socket.messagesOf("Edit")).toEqual([]);
  after.socket.receive({ ...TIMELINE, playing: true, loop: false });
  after.socket.receive({ ...TIMELINE, epoch: 2, position: 12_500_000 });
  expect(after.socket.messagesOf("Edit")).toEqual([{ name: "Edit", playing: false, position: 12_500_000, loop: true }]);
  const later = openPlayback("m", "motions");
  restorePosition(later.playback);
  later.socket.receive(TIMELINE);
  expect(later.socket.messagesOf("Edit")).toEqual([]);
});

test("other motions and sessions ignore the saved position", () => {
  for (const [kind, next] of [
    ["motions", "other"],
    ["sessions", "m"],
  ] as const) {
    const before = openPlayback("m", kind);
    before.socket.receive(TIMELINE);
    savePosition(before.playback, 0);
    const after = openPlayback(next, kind);
    restorePosition(after.playback);
    after.socket.receive(TIMELINE);
    expect(after.socket.messagesOf("Edit"), kind).toEqual([]);
  }
});
