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
/** Frames of the crossfade after a discontinuity. */
const CROSSFADE_FRAMES = 384;

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

/** Render consecutive slots from `STAGE` on; return the slots and the joined planes. */
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
  let boundary = silentBoundary(track.channels);
  let stage = from;
  speeds.forEach((speed, index) => {
    const slot: Slot = { index, stageTime: stage, speed, run: 1 };
    const spans = spansBetween(all, slot.stageTime, stageTimeAtEnd(slot));
    const rendered = renderSlot(track, sound, slot, spans, boundary);
    boundary = rendered.boundary;
    stage = stageTimeAtEnd(slot);
    rendered.planes.forEach((plane, channel) => out[channel].set(plane, index * SLOT_FRAMES));
    slots.push(slot);
  });
  return { out, slots };
}

/** Return the position of a frame in the track, in samples, without discontinuities. */
function positionOf(slots: readonly Slot[], frame: number): number {
  const slot = slots[Math.floor(frame / SLOT_FRAMES)];
  return ((slot.stageTime - STAGE + (frame - slot.index * SLOT_FRAMES) * (slot.speed / 48_000) * 1e6) * 48_000) / 1e6;
}

/** Return the largest step between consecutive frames. */
function maxStep(plane: Float32Array, from = 1, to = plane.length): number {
  let max = 0;
  for (let frame = from; frame < to; frame++) max = Math.max(max, Math.abs(plane[frame] - plane[frame - 1]));
  return max;
}

/** Upper bound of the difference between two samples of the tones. */
const MAX_SAMPLE_STEP = 0.055;

test("slots at speed 1 reproduce the sound exactly in every channel", () => {
  const track = createTrack(4, 2);
  const { out } = play(track, timelines(4e6), new Array<number>(20).fill(1));
  out.forEach((plane, channel) => {
    const errors = plane.map((sample, frame) =>
      frame < CROSSFADE_FRAMES ? 0 : Math.abs(sample - toneSample(frame, channel)),
    );
    expect(Math.max(...errors)).toBeLessThan(1e-5);
  });
});

test("sound that starts between two samples is copied from the nearest one", () => {
  const track = createTrack(1);
  // 0.4 samples after a whole one, and 1,000 samples after the start
  const { out } = play(track, timelines(1_000_000), [1, 1], () => true, STAGE + (1_000.4 / 48_000) * 1e6);
  for (let frame = CROSSFADE_FRAMES; frame < 2 * SLOT_FRAMES; frame++)
    expect(out[0][frame]).toBe(Math.fround(toneSample(1_000 + frame)));
});

test("changes of speed are continuous and follow the slots", () => {
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
      for (let frame = CROSSFADE_FRAMES; frame < plane.length; frame += 7)
        expect(Math.abs(plane[frame] - toneSample(positionOf(slots, frame)))).toBeLessThan(3e-3);
      expect(maxStep(plane)).toBeLessThan(MAX_SAMPLE_STEP);
    }),
    { numRuns: 20 },
  );
});

describe("discontinuities", () => {
  test("a loop restarts with the motion without a click", () => {
    // A duration at which the tones do not join.
    const track = createTrack(1.03);
    const {
      out: [plane],
    } = play(track, timelines(1_030_000), new Array<number>(40).fill(1));
    expect(maxStep(plane)).toBeLessThan(MAX_SAMPLE_STEP);
    const again = 1.03 * 48_000;
    for (let frame = CROSSFADE_FRAMES; frame < 40_000; frame += 11)
      expect(Math.abs(plane[frame + again] - toneSample(frame))).toBeLessThan(1e-5);
  });

  test("missing packets are silent, with soft edges", () => {
    const track = createTrack(4);
    const {
      out: [plane],
    } = play(track, timelines(4e6), new Array<number>(16).fill(1), (number) => number !== 5 && number !== 6);
    expect(maxStep(plane)).toBeLessThan(MAX_SAMPLE_STEP);
    const [first, end] = [track.firstSample(5), track.firstSample(7)];
    expect(plane.subarray(first + CROSSFADE_FRAMES, end - 1).every((sample) => sample === 0)).toBe(true);
    for (const frame of [first - 20, end + CROSSFADE_FRAMES])
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
    expect(ended.subarray(48_000 + CROSSFADE_FRAMES).every((sample) => sample === 0)).toBe(true);
    expect(maxStep(ended)).toBeLessThan(MAX_SAMPLE_STEP);
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
    expect(paused.subarray(9_600 + CROSSFADE_FRAMES).every((sample) => sample === 0)).toBe(true);
    expect(maxStep(paused)).toBeLessThan(MAX_SAMPLE_STEP);
  });
});

test("silence is reported", () => {
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

test("required packets are those heard in a span, with a margin", () => {
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
