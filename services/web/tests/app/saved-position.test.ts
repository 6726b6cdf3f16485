import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { RemotePlayback } from "../../src/app/remote-playback";
import { restorePosition, savePosition } from "../../src/app/saved-position";
import type { EngineCommand } from "../../src/engine/message";
import type { PlaybackKind } from "../../src/engine/playback";
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

beforeEach(() => stubStorage("sessionStorage"));
afterEach(() => void vi.unstubAllGlobals());

/** Open a playback at position 12.5 s; return it with the commands that it sends. */
function openPlayback(id: string, kind: PlaybackKind): { playback: RemotePlayback; commands: EngineCommand[] } {
  const commands: EngineCommand[] = [];
  const playback = new RemotePlayback(1, id, kind, (command) => commands.push(command));
  playback.setTime({ now: 0, position: 12.5, ownTime: 0, isClockSettled: true });
  return { playback, commands };
}

test("motion resumes at its saved position once", () => {
  const before = openPlayback("m", "motions");
  before.playback.apply({ event: "timeline", timeline: TIMELINE });
  savePosition(before.playback);
  const after = openPlayback("m", "motions");
  restorePosition(after.playback);
  expect(after.commands).toEqual([]);
  after.playback.apply({ event: "timeline", timeline: { ...TIMELINE, playing: true, loop: false } });
  after.playback.apply({ event: "timeline", timeline: { ...TIMELINE, epoch: 2, position: 12_500_000 } });
  expect(after.commands).toEqual([{ type: "edit", change: { playing: false, position: 12_500_000, loop: true } }]);
  const later = openPlayback("m", "motions");
  restorePosition(later.playback);
  later.playback.apply({ event: "timeline", timeline: TIMELINE });
  expect(later.commands).toEqual([]);
});

test("other motions and sessions ignore the saved position", () => {
  for (const [kind, next] of [
    ["motions", "other"],
    ["sessions", "m"],
  ] as const) {
    const before = openPlayback("m", kind);
    before.playback.apply({ event: "timeline", timeline: TIMELINE });
    savePosition(before.playback);
    const after = openPlayback(next, kind);
    restorePosition(after.playback);
    after.playback.apply({ event: "timeline", timeline: TIMELINE });
    expect(after.commands, kind).toEqual([]);
  }
});
