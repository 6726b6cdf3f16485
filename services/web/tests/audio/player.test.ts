import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import { AudioPlayer } from "../../src/audio/player";
import { PACKET_SAMPLES } from "../../src/codec/audio";
import type { AudioBlockStore } from "../../src/playout/audio-store";
import { positionAt, TimelineHistory } from "../../src/playout/timeline";
import type { TimelineState } from "../../src/wire/messages";
import { FakeAudioContext } from "./fake-audio-context";
import { createToneDecoder, createTrack, toneSample } from "./tone";

const UNIX = 1_774_000_000_000_000;
const STEP = 25;
/** Seconds of the motion and its sound: the tones do not meet where it loops. */
const SECONDS = 6.03;
/** No two samples of the tones differ by more. */
const STEEP = 0.056;

const track = createTrack(SECONDS);
let device: FakeAudioContext;
let now: number;
let timelines: TimelineHistory;
let missing: Set<number>;
let ownOffset: number;
let player: AudioPlayer;

beforeEach(() => {
  vi.useFakeTimers();
  device = new FakeAudioContext(5_000);
  now = 5_000;
  timelines = new TimelineHistory();
  missing = new Set();
  ownOffset = 0;
});
afterEach(() => {
  player.close();
  vi.useRealTimers();
});

function own(nowMs: number): number {
  return UNIX + nowMs * 1000 + ownOffset;
}

function retime(change: Partial<TimelineState> = {}): void {
  timelines.put({
    name: "TimelineState",
    epoch: (timelines.newest?.epoch ?? 0) + 1,
    motion: "dance",
    clock: own(5_000),
    position: 0,
    playing: true,
    loop: true,
    duration: track.durationUs,
    ...change,
  });
}

function start(settled = () => true): void {
  const store = {
    track,
    packet: (number: number) => (number < track.packetCount && !missing.has(number) ? Uint8Array.of(1) : null),
  };
  player = new AudioPlayer(
    device as unknown as AudioContext,
    new EventTarget() as AudioNode,
    {
      store: store as AudioBlockStore,
      timelines,
      viewerTime: own,
      isClockSettled: settled,
    },
    createToneDecoder(track).make,
    () => now,
  );
}

/** Milliseconds pass on the page and the device, which runs at `speed`. */
function pass(ms: number, speed = 1): void {
  for (let left = ms; left > 0; left -= STEP) {
    device.advance((STEP * speed) / 1000);
    now += STEP;
    vi.advanceTimersByTime(STEP);
  }
}

/** How far what came out at a page time is from the sound at the stage time told for it; the device's own latency counts. */
function error(pageMs: number): number {
  const lead = player.leadAt(pageMs)!;
  const frame = Math.round((pageMs - device.offset - device.latency) * 48);
  const there = ((lead.time - timelines.newest!.clock) / 1e6) % (track.durationUs / 1e6);
  // within a frame of the clock's own steps, whatever the tones do in it
  const at = there * 48_000;
  return Math.min(...[-1, -0.5, 0, 0.5, 1].map((off) => Math.abs(device.output[frame].sample - toneSample(at + off))));
}

/** The largest step from a frame to the next, over frames put out. */
function step(from: number): number {
  let most = 0;
  for (let frame = from + 1; frame < device.output.length; frame++)
    most = Math.max(most, Math.abs(device.output[frame].sample - device.output[frame - 1].sample));
  return most;
}

describe("what is heard", () => {
  test("is the sound of the stage time that is told, without a gap or a click, through a loop", () => {
    retime();
    start();
    pass(200);
    const begun = device.output.length;
    pass(9_000);
    expect(device.output.slice(begun).every(({ sources }) => sources === 1)).toBe(true);
    expect(step(0)).toBeLessThan(STEEP);
    for (let back = 0; back < 2_000; back += 10) expect(error(now - back)).toBeLessThan(0.01);
    expect(Math.abs(player.leadAt(now)!.time - own(now))).toBeLessThan(3_000);
  });

  test("stays with the stage on a device that runs another speed, in one run", () => {
    retime();
    start();
    pass(500, 1.0003);
    const { run } = player.leadAt(now)!;
    pass(30_000, 1.0003);
    expect(player.leadAt(now)!.run).toBe(run);
    expect(Math.abs(player.leadAt(now)!.time - own(now))).toBeLessThan(20_000);
    expect(step(48_000)).toBeLessThan(STEEP);
  });

  test("is nothing until the stage's clock is known, and while the device stands", () => {
    let settled = false;
    retime();
    start(() => settled);
    pass(1_000);
    expect(player.leadAt(now)).toBeNull();
    settled = true;
    pass(1_000);
    const { run } = player.leadAt(now)!;
    device.state = "suspended";
    pass(0);
    expect(player.leadAt(now)).toBeNull();
    now += 3_000;
    vi.advanceTimersByTime(100);
    device.state = "running";
    now = 5_000 + device.currentTime * 1000;
    pass(500);
    expect(player.leadAt(now)!.run).toBeGreaterThan(run);
    expect(error(now)).toBeLessThan(0.01);
  });
});

describe("an edit of the timeline", () => {
  beforeEach(() => {
    retime();
    start();
    pass(2_000);
  });

  test("that is told in time takes effect to the frame", () => {
    retime({ clock: own(now + 150), position: 1_000_000, playing: true });
    player.retime();
    pass(1_000);
    for (let back = 0; back < 500; back += 10) {
      const lead = player.leadAt(now - back)!;
      const at = (positionAt(timelines.newest!, lead.time) * 48_000) / 1e6;
      const frame = Math.round((now - back - device.offset - device.latency) * 48);
      expect(
        Math.min(...[-1, -0.5, 0, 0.5, 1].map((off) => Math.abs(device.output[frame].sample - toneSample(at + off)))),
      ).toBeLessThan(0.01);
    }
    expect(device.output.slice(48_000).every(({ sources }) => sources === 1)).toBe(true);
    expect(step(48_000)).toBeLessThan(STEEP);
  });

  test("to pause is silence, and to go on is sound again", () => {
    retime({ clock: own(now + 150), position: 2_150_000, playing: false });
    player.retime();
    pass(1_000);
    expect(device.output.slice(-24_000).every(({ sample }) => sample === 0)).toBe(true);
    expect(player.leadAt(now)).not.toBeNull();
    retime({ clock: own(now + 150), position: 2_150_000 });
    player.retime();
    pass(1_000);
    expect(device.output.slice(-4_800).some(({ sample }) => Math.abs(sample) > 0.3)).toBe(true);
    expect(step(48_000)).toBeLessThan(STEEP);
  });

  test("that comes late cuts off what is heard, at once", () => {
    const begun = device.output.length;
    retime({ clock: own(now - 100), position: 0, playing: false });
    player.retime();
    pass(500);
    const heard = device.output.slice(begun).findLastIndex(({ sample }) => sample !== 0);
    expect(heard).toBeLessThan(480);
  });

  test("that changes nothing leaves the sound alone", () => {
    const { run } = player.leadAt(now)!;
    retime({ clock: own(5_000) + track.durationUs, position: 0 });
    retime({ clock: own(6_000), position: 1_000_000 });
    player.retime();
    pass(1_000);
    expect(player.leadAt(now)!.run).toBe(run);
    expect(device.output.slice(48_000).every(({ sources }) => sources === 1)).toBe(true);
    expect(step(48_000)).toBeLessThan(STEEP);
  });
});

test("packets that have not come are waited for, then silent, and heard from when they have", () => {
  const gone = Array.from({ length: 12 }, (_, at) => 40 + at);
  missing = new Set(gone);
  retime();
  start();
  const heard = (number: number) =>
    device.output[
      Math.round(track.firstSample(number) + PACKET_SAMPLES / 2 + (device.offset - 5_000 - device.latency) * 48)
    ]?.sample;
  pass(2_000);
  // those up to here were missed, the others come while there is time
  missing = new Set(gone.slice(0, 4));
  pass(3_000);
  expect([41, 42].map(heard)).toEqual([0, 0]);
  expect(Math.abs(heard(47)!) + Math.abs(heard(48)!)).toBeGreaterThan(0);
  // at the edge of what is missing a sample between two is told from one of them
  expect(step(0)).toBeLessThan(2 * STEEP);
});
