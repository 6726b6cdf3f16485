import { expect, test } from "vitest";
import { RemotePlayback } from "../../src/app/remote-playback";
import type { EngineCommand } from "../../src/engine/message";

const AUDIO = { motion: [60, 600, 60, 60], channels: 2, preSkip: 312, samples: 480_000, kbps: [24] } as const;
const FIGURE = { motion: "m", performerCount: 2, duration: 10, levelCount: 3 } as const;

function openPlayback(): { playback: RemotePlayback; commands: EngineCommand[]; events: string[] } {
  const commands: EngineCommand[] = [];
  const events: string[] = [];
  const playback = new RemotePlayback(1, "s", "sessions", (command) => commands.push(command));
  for (const type of ["open", "figure", "tracks", "timeline", "presence", "blocks", "closed", "welcome"])
    playback.addEventListener(type, () => events.push(type));
  return { playback, commands, events };
}

test("changes are applied before their events", () => {
  const { playback, events } = openPlayback();
  const seen: unknown[] = [];
  playback.addEventListener("figure", () => seen.push(playback.performerCount));
  playback.addEventListener("closed", () => seen.push(playback.isConnected, playback.isClosed));
  playback.apply({ event: "open" });
  playback.apply({ event: "figure", ...FIGURE });
  playback.apply({ event: "blocks", blocks: Int8Array.of(1, -1) });
  playback.apply({ event: "welcome", puppeteer: "a" });
  playback.apply({ event: "closed", reason: "gone", isClosed: true });
  expect(events).toEqual(["open", "figure", "blocks", "welcome", "closed"]);
  // The page tells a lost connection from one that never was.
  expect(seen).toEqual([2, true, true]);
  expect([playback.isConnected, playback.puppeteerId, [...playback.blocks]]).toEqual([false, "a", [1, -1]]);
});

test("sound is available by packets until the motion has another", () => {
  const { playback, events } = openPlayback();
  playback.apply({ event: "figure", ...FIGURE, audio: { ...AUDIO, motion: [...AUDIO.motion] } });
  playback.apply({ event: "audio packets", packets: [{ number: 4, data: Uint8Array.of(7) }] });
  const { audio } = playback;
  expect([audio?.track.packetCount, audio?.packet(4), audio?.packet(5)]).toEqual([167, Uint8Array.of(7), null]);
  playback.apply({ event: "tracks", ...FIGURE });
  expect(playback.audio).toBe(audio);
  playback.apply({ event: "figure", ...FIGURE, audio: null });
  expect(playback.audio).toBeNull();
  expect(events).toEqual(["figure", "tracks", "figure"]);
});

test("time runs on between the engine's messages", () => {
  const { playback } = openPlayback();
  expect([playback.position, playback.isClockSettled]).toEqual([0, false]);
  playback.setTime({ now: 100, position: 2.5, ownTime: 5e6, isClockSettled: true });
  expect([playback.position, playback.ownTime(120), playback.isClockSettled]).toEqual([2.5, 5_020_000, true]);
});

test("the time of the sound is sent at intervals while there is sound, and its end once", () => {
  const { playback, commands } = openPlayback();
  playback.sendLead(0);
  playback.leader = (now) => (now < 100 ? { time: now * 1000, run: 1 } : null);
  for (const now of [10, 20, 50, 65, 90, 110, 120, 180]) playback.sendLead(now);
  expect(commands).toEqual([
    { type: "lead", lead: { time: 10_000, run: 1, at: 10 } },
    { type: "lead", lead: { time: 65_000, run: 1, at: 65 } },
    { type: "lead", lead: null },
  ]);
});

test("a timeline of a new connection is accepted whatever its epoch", () => {
  const { playback } = openPlayback();
  const timeline = {
    name: "TimelineState",
    motion: "m",
    epoch: 9,
    playing: true,
    position: 0,
    clock: 0,
    loop: true,
    duration: 1,
  } as const;
  playback.apply({ event: "timeline", timeline });
  playback.apply({ event: "open" });
  playback.apply({ event: "timeline", timeline: { ...timeline, epoch: 1, playing: false } });
  expect(playback.timeline?.playing).toBe(false);
});
