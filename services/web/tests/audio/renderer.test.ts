import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import { renderSlot, requiredPackets, silentBoundary } from "../../src/audio/renderer";
import { SLOT_FRAMES, SLOT_US, type Slot, stageTimeAtEnd } from "../../src/audio/schedule";
import type { AudioTrack } from "../../src/codec/audio";
import { TimelineHistory } from "../../src/playout/timeline";
import { spansBetween, type TimelineSpan } from "../../src/playout/timeline-span";
import type { TimelineState } from "../../src/wire/messages";
import { createTrack, packetSamples, toneSample } from "./tone";

const STAGE = 1_774_000_000_000_000;
/** A joint is over after so many frames. */
const JOINT = 384;

function timelines(duration: number, change: Partial<TimelineState> = {}): TimelineHistory {
  const all = new TimelineHistory();
  all.put({
    name: "TimelineState",
    epoch: 1,
    motion: "dance",
    clock: STAGE,
    position: 0,
    playing: true,
    loop: true,
    duration,
    ...change,
  });
  return all;
}

/** The sound of so many slots from `STAGE` on, one after the other; the slots, and the planes put together. */
function play(
  track: AudioTrack,
  all: TimelineHistory,
  speeds: readonly number[],
  has: (number: number) => boolean = () => true,
  from = STAGE,
) {
  const cache = new Map<number, Float32Array<ArrayBuffer>[]>();
  const sound = (number: number) => {
    if (!has(number) || number < 0 || number >= track.packetCount) return null;
    if (!cache.has(number)) cache.set(number, packetSamples(track, number));
    return cache.get(number)!;
  };
  const out = Array.from({ length: track.channels }, () => new Float32Array(SLOT_FRAMES * speeds.length));
  const slots: Slot[] = [];
  let joint = silentBoundary(track.channels);
  let stage = from;
  speeds.forEach((speed, index) => {
    const slot: Slot = { index, stageTime: stage, speed, run: 1 };
    const spans = spansBetween(all, slot.stageTime, stageTimeAtEnd(slot));
    const sounding = renderSlot(track, sound, slot, spans, joint);
    joint = sounding.boundary;
    stage = stageTimeAtEnd(slot);
    sounding.planes.forEach((plane, channel) => out[channel].set(plane, index * SLOT_FRAMES));
    slots.push(slot);
  });
  return { out, slots };
}

/** Where in the track frame `frame` is, samples, where nothing jumps. */
function placeOf(slots: readonly Slot[], frame: number): number {
  const slot = slots[Math.floor(frame / SLOT_FRAMES)];
  return ((slot.stageTime - STAGE + (frame - slot.index * SLOT_FRAMES) * (slot.speed / 48_000) * 1e6) * 48_000) / 1e6;
}

/** The largest step from a frame to the next. */
function step(plane: Float32Array, from = 1, to = plane.length): number {
  let most = 0;
  for (let frame = from; frame < to; frame++) most = Math.max(most, Math.abs(plane[frame] - plane[frame - 1]));
  return most;
}

/** No two samples of the tones differ by more. */
const STEEP = 0.055;

test("slots at speed one are the sound, sample by sample, in every channel", () => {
  const track = createTrack(4, 2);
  const { out } = play(track, timelines(4e6), new Array<number>(20).fill(1));
  out.forEach((plane, channel) => {
    const errors = plane.map((sample, frame) => (frame < JOINT ? 0 : Math.abs(sample - toneSample(frame, channel))));
    expect(Math.max(...errors)).toBeLessThan(1e-5);
  });
});

test("through changes of speed the sound goes on without a click, where the slots say", () => {
  const speeds = fc.array(
    fc.integer({ min: -10, max: 10 }).map((halves) => 1 + halves * 0.0005),
    { minLength: 4, maxLength: 10 },
  );
  fc.assert(
    fc.property(speeds, (all) => {
      const {
        out: [plane],
        slots,
      } = play(createTrack(4), timelines(4e6), all);
      for (let frame = JOINT; frame < plane.length; frame += 7)
        expect(Math.abs(plane[frame] - toneSample(placeOf(slots, frame)))).toBeLessThan(3e-3);
      expect(step(plane)).toBeLessThan(STEEP);
    }),
    { numRuns: 20 },
  );
});

describe("where the sound jumps", () => {
  test("a loop begins anew with the motion, and does not click", () => {
    // of a length at which the tones do not meet
    const track = createTrack(1.03);
    const {
      out: [plane],
    } = play(track, timelines(1_030_000), new Array<number>(40).fill(1));
    expect(step(plane)).toBeLessThan(STEEP);
    const again = 1.03 * 48_000;
    for (let frame = JOINT; frame < 40_000; frame += 11)
      expect(Math.abs(plane[frame + again] - toneSample(frame))).toBeLessThan(1e-5);
  });

  test("packets that are missing are silent, with soft ends", () => {
    const track = createTrack(4);
    const {
      out: [plane],
    } = play(track, timelines(4e6), new Array<number>(16).fill(1), (number) => number !== 5 && number !== 6);
    expect(step(plane)).toBeLessThan(STEEP);
    const [first, end] = [track.firstSample(5), track.firstSample(7)];
    expect(plane.subarray(first + JOINT, end - 1).every((sample) => sample === 0)).toBe(true);
    for (const frame of [first - 20, end + JOINT])
      expect(Math.abs(plane[frame] - toneSample(frame))).toBeLessThan(1e-3);
  });

  test("a pause and the end of the sound are silent", () => {
    const track = createTrack(1);
    const longer = new TimelineHistory();
    longer.put({
      name: "TimelineState",
      epoch: 1,
      motion: "dance",
      clock: STAGE,
      position: 0,
      playing: true,
      loop: false,
      duration: 3e6,
    });
    const {
      out: [ended],
    } = play(track, longer, new Array<number>(24).fill(1));
    expect(ended.subarray(48_000 + JOINT).every((sample) => sample === 0)).toBe(true);
    expect(step(ended)).toBeLessThan(STEEP);
    const edited = timelines(4e6);
    edited.put({
      name: "TimelineState",
      epoch: 2,
      motion: "dance",
      clock: STAGE + 200_000,
      position: 200_000,
      playing: false,
      loop: true,
      duration: 4e6,
    });
    const {
      out: [paused],
    } = play(createTrack(4), edited, new Array<number>(8).fill(1));
    expect(Math.abs(paused[9_599] - toneSample(9_599))).toBeLessThan(1e-5);
    expect(paused.subarray(9_600 + JOINT).every((sample) => sample === 0)).toBe(true);
    expect(step(paused)).toBeLessThan(STEEP);
  });
});

test("what is silent is said to be", () => {
  const track = createTrack(1);
  const slot: Slot = { index: 0, stageTime: STAGE, speed: 1, run: 1 };
  const still: TimelineSpan[] = [{ start: STAGE, end: STAGE + SLOT_US, position: 0, isMoving: false }];
  expect(renderSlot(track, () => null, slot, still, silentBoundary(1)).isSilent).toBe(true);
  expect(
    renderSlot(
      track,
      (number) => packetSamples(track, number),
      slot,
      [{ ...still[0], isMoving: true }],
      silentBoundary(1),
    ).isSilent,
  ).toBe(false);
});

test("the packets that a stretch needs are those that are heard in it, and what lies about them", () => {
  const track = createTrack(1);
  const span = (position: number, length: number): TimelineSpan => ({
    start: 0,
    end: length,
    position,
    isMoving: true,
  });
  expect(requiredPackets(track, [span(0, 50_000)])).toEqual([0]);
  expect(requiredPackets(track, [span(0, 53_400)])).toEqual([0, 1]);
  expect(requiredPackets(track, [span(940_000, 60_000), span(0, 10_000)])).toEqual([15, 16, 0]);
  expect(requiredPackets(track, [{ ...span(0, 50_000), isMoving: false }])).toEqual([]);
  for (let number = 0; number < track.packetCount - 1; number++)
    expect(requiredPackets(track, [span(track.packetStartUs(number) + 1000, 58_000)])).toEqual([number]);
});
