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

/** What is watched, standing at 12.5 s, and its line. */
function watched(id: string, place: PlaybackKind): { room: Playback; line: FakeWebSocket } {
  const viewer = new Viewer({ url: `ws://stage/v1/${place}/${id}/stream`, now: () => 0, solver: null });
  opened.push(viewer);
  const line = FakeWebSocket.last;
  line.accept();
  return { room: { id, place, viewer, position: () => 12.5 } as unknown as Playback, line };
}

test("a motion watched alone goes on where it was left, once", () => {
  const before = watched("m", "motions");
  before.line.receive(TIMELINE);
  savePosition(before.room, 0);
  const after = watched("m", "motions");
  restorePosition(after.room);
  expect(after.line.messagesOf("Edit")).toEqual([]);
  after.line.receive({ ...TIMELINE, playing: true, loop: false });
  after.line.receive({ ...TIMELINE, epoch: 2, position: 12_500_000 });
  expect(after.line.messagesOf("Edit")).toEqual([{ name: "Edit", playing: false, position: 12_500_000, loop: true }]);
  const later = watched("m", "motions");
  restorePosition(later.room);
  later.line.receive(TIMELINE);
  expect(later.line.messagesOf("Edit")).toEqual([]);
});

test("another motion begins at its beginning, and a session is where everyone is", () => {
  for (const [place, next] of [
    ["motions", "other"],
    ["sessions", "m"],
  ] as const) {
    const before = watched("m", place);
    before.line.receive(TIMELINE);
    savePosition(before.room, 0);
    const after = watched(next, place);
    restorePosition(after.room);
    after.line.receive(TIMELINE);
    expect(after.line.messagesOf("Edit"), place).toEqual([]);
  }
});
