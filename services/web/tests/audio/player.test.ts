import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import { AudioPlayer } from "../../src/audio/player";
import { PACKET_SAMPLES } from "../../src/codec/audio";
import type { AudioBlockStore } from "../../src/playout/audio-store";
import { positionAt, TimelineHistory } from "../../src/playout/timeline";
import type { TimelineState } from "../../src/wire/messages";
import { FakeAudioContext } from "./fake-audio-context";
import { createToneDecoder, createTrack, toneSample } from "./tone";

const UNIX = 1_774_000_000_000_000;
const STEP_MS = 25;
/** Duration of the motion and its sound in seconds; the tones do not join where it loops. */
const SECONDS = 6.03;
/** Upper bound of the difference between two samples of the tones. */
const MAX_SAMPLE_STEP = 0.056;

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

function viewerTime(nowMs: number): number {
  return UNIX + nowMs * 1000 + ownOffset;
}

function retime(change: Partial<TimelineState> = {}): void {
  timelines.put({
    name: "TimelineState",
    epoch: (timelines.newest?.epoch ?? 0) + 1,
    motion: "dance",
    clock: viewerTime(5_000),
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
      viewerTime,
      isClockSettled: settled,
    },
    createToneDecoder(track).createDecoder,
    () => now,
  );
}

/** Let milliseconds pass on the page and on the device, which runs at `speed`. */
function pass(ms: number, speed = 1): void {
  for (let left = ms; left > 0; left -= STEP_MS) {
    device.advance((STEP_MS * speed) / 1000);
    now += STEP_MS;
    vi.advanceTimersByTime(STEP_MS);
  }
}

/**
 * Return the difference between the output at a page time and the sound at the reported stage time, device latency
 * included.
 */
function outputError(pageMs: number): number {
  const lead = player.leadAt(pageMs)!;
  const frame = Math.round((pageMs - device.offset - device.latency) * 48);
  const motionSeconds = ((lead.time - timelines.newest!.clock) / 1e6) % (track.durationUs / 1e6);
  // Within one frame of the clock's resolution.
  const at = motionSeconds * 48_000;
  return Math.min(...[-1, -0.5, 0, 0.5, 1].map((off) => Math.abs(device.output[frame].sample - toneSample(at + off))));
}

/** Return the largest step between consecutive output frames. */
function maxStep(from: number): number {
  let max = 0;
  for (let frame = from + 1; frame < device.output.length; frame++)
    max = Math.max(max, Math.abs(device.output[frame].sample - device.output[frame - 1].sample));
  return max;
}

describe("playback", () => {
  test("plays in time on a device whose timestamps lie in the future", () => {
    device.getOutputTimestamp = () => ({
      contextTime: device.currentTime,
      performanceTime: now + device.currentTime * 1000,
    });
    retime();
    start();
    pass(1_000);
    expect(Math.abs(player.leadAt(now)!.time - viewerTime(now))).toBeLessThan(STEP_MS * 1000);
    expect(device.output.at(-1)?.sources).toBe(1);
  });

  test("plays the reported stage time without gaps or clicks, across a loop", () => {
    retime();
    start();
    pass(200);
    const begun = device.output.length;
    pass(9_000);
    expect(device.output.slice(begun).every(({ sources }) => sources === 1)).toBe(true);
    expect(maxStep(0)).toBeLessThan(MAX_SAMPLE_STEP);
    for (let back = 0; back < 2_000; back += 10) expect(outputError(now - back)).toBeLessThan(0.01);
    expect(Math.abs(player.leadAt(now)!.time - viewerTime(now))).toBeLessThan(3_000);
  });

  test("stays in sync with a device of another speed, in one run", () => {
    retime();
    start();
    pass(500, 1.0003);
    const { run } = player.leadAt(now)!;
    pass(30_000, 1.0003);
    expect(player.leadAt(now)!.run).toBe(run);
    expect(Math.abs(player.leadAt(now)!.time - viewerTime(now))).toBeLessThan(20_000);
    expect(maxStep(48_000)).toBeLessThan(MAX_SAMPLE_STEP);
  });

  test("waits for the stage clock and for a running device", () => {
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
    expect(outputError(now)).toBeLessThan(0.01);
  });
});

describe("an edit of the timeline", () => {
  beforeEach(() => {
    retime();
    start();
    pass(2_000);
  });

  test("announced in time takes effect exactly", () => {
    retime({ clock: viewerTime(now + 150), position: 1_000_000, playing: true });
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
    expect(maxStep(48_000)).toBeLessThan(MAX_SAMPLE_STEP);
  });

  test("to pause is silent, and to resume is audible", () => {
    retime({ clock: viewerTime(now + 150), position: 2_150_000, playing: false });
    player.retime();
    pass(1_000);
    expect(device.output.slice(-24_000).every(({ sample }) => sample === 0)).toBe(true);
    expect(player.leadAt(now)).not.toBeNull();
    retime({ clock: viewerTime(now + 150), position: 2_150_000 });
    player.retime();
    pass(1_000);
    expect(device.output.slice(-4_800).some(({ sample }) => Math.abs(sample) > 0.3)).toBe(true);
    expect(maxStep(48_000)).toBeLessThan(MAX_SAMPLE_STEP);
  });

  test("that arrives late cuts the sound at once", () => {
    const begun = device.output.length;
    retime({ clock: viewerTime(now - 100), position: 0, playing: false });
    player.retime();
    pass(500);
    const sampleOf = device.output.slice(begun).findLastIndex(({ sample }) => sample !== 0);
    expect(sampleOf).toBeLessThan(480);
  });

  test("that changes nothing does not affect the sound", () => {
    const { run } = player.leadAt(now)!;
    retime({ clock: viewerTime(5_000) + track.durationUs, position: 0 });
    retime({ clock: viewerTime(6_000), position: 1_000_000 });
    player.retime();
    pass(1_000);
    expect(player.leadAt(now)!.run).toBe(run);
    expect(device.output.slice(48_000).every(({ sources }) => sources === 1)).toBe(true);
    expect(maxStep(48_000)).toBeLessThan(MAX_SAMPLE_STEP);
  });
});

test("missing packets are waited for, then silent, and audible later", () => {
  const missingPackets = Array.from({ length: 12 }, (_, at) => 40 + at);
  missing = new Set(missingPackets);
  retime();
  start();
  const sampleOf = (number: number) =>
    device.output[
      Math.round(track.firstSample(number) + PACKET_SAMPLES / 2 + (device.offset - 5_000 - device.latency) * 48)
    ]?.sample;
  pass(2_000);
  // These are missed; the others arrive in time.
  missing = new Set(missingPackets.slice(0, 4));
  pass(3_000);
  expect([41, 42].map(sampleOf)).toEqual([0, 0]);
  expect(Math.abs(sampleOf(47)!) + Math.abs(sampleOf(48)!)).toBeGreaterThan(0);
  // At the edge of missing packets a sample may be interpolated from one side.
  expect(maxStep(0)).toBeLessThan(2 * MAX_SAMPLE_STEP);
});
