import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { Viewer } from "../src/client/viewer";
import { goOn, leave } from "../src/left";
import type { Place, Room } from "../src/room";
import { Line } from "./client/line";
import { stubStorage } from "./storage/stubs";

const TIMELINE = { name: "TimelineState", motion: "m", epoch: 1, playing: false, position: 0, clock: 0, loop: true, duration: 30_000_000 } as const;

let opened: Viewer[];

beforeEach(() => {
  opened = [];
  Line.install();
  stubStorage("sessionStorage");
});
afterEach(() => {
  for (const viewer of opened) viewer.close();
  Line.remove();
  vi.unstubAllGlobals();
});

/** What is watched, standing at 12.5 s, and its line. */
function watched(id: string, place: Place): { room: Room; line: Line } {
  const viewer = new Viewer({ url: `ws://stage/v1/${place}/${id}/stream`, now: () => 0, solver: null });
  opened.push(viewer);
  const line = Line.last;
  line.accept();
  return { room: { id, place, viewer, position: () => 12.5 } as unknown as Room, line };
}

test("a motion watched alone goes on where it was left, once", () => {
  const before = watched("m", "motions");
  before.line.say(TIMELINE);
  leave(before.room, 0);
  const after = watched("m", "motions");
  goOn(after.room);
  expect(after.line.of("Edit")).toEqual([]);
  after.line.say({ ...TIMELINE, playing: true, loop: false });
  after.line.say({ ...TIMELINE, epoch: 2, position: 12_500_000 });
  expect(after.line.of("Edit")).toEqual([{ name: "Edit", playing: false, position: 12_500_000, loop: true }]);
  const later = watched("m", "motions");
  goOn(later.room);
  later.line.say(TIMELINE);
  expect(later.line.of("Edit")).toEqual([]);
});

test("another motion begins at its beginning, and a session is where everyone is", () => {
  for (const [place, next] of [["motions", "other"], ["sessions", "m"]] as const) {
    const before = watched("m", place);
    before.line.say(TIMELINE);
    leave(before.room, 0);
    const after = watched(next, place);
    goOn(after.room);
    after.line.say(TIMELINE);
    expect(after.line.of("Edit"), place).toEqual([]);
  }
});
