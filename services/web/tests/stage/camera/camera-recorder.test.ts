import { setFlagsFromString } from "node:v8";
import { runInNewContext } from "node:vm";
import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import type { CameraKeyframe } from "../../../src/client/api";
import {
  CameraRecorder,
  FOV_TOLERANCE_RAD,
  MAX_AGE_US,
  MAX_KEYFRAMES,
  POSITION_TOLERANCE_M,
} from "../../../src/stage/camera/camera-recorder";
import { createView, viewFromNumbers } from "../../../src/stage/camera/view";

const BEGAN = 1_700_000_000_000_000;
const FRAME = 16_667;
/** Half of the rounding step of keyframes. */
const ROUNDED = 0.5e-4 * Math.sqrt(3);

type Numbers = number[];

/** Record `frames` frames of a camera at `at(seconds)`; return the recorder and the recorded values. */
function record(
  frames: number,
  at: (seconds: number) => Numbers,
  every = FRAME,
): [CameraRecorder, [number, Numbers][]] {
  const recorder = new CameraRecorder();
  const view = createView();
  const samples: [number, Numbers][] = [];
  for (let frame = 0; frame < frames; frame++) {
    const numbers = at((frame * every) / 1e6);
    viewFromNumbers(numbers, view);
    recorder.add(BEGAN + frame * every, view);
    samples.push([BEGAN + frame * every, numbers]);
  }
  return [recorder, samples];
}

/** Interpolate between keyframes at a time, as a stored recording does. */
function interpolated(keys: readonly CameraKeyframe[], time: number): Numbers {
  const flat = ({ position, gaze, fov }: CameraKeyframe) => [...position, ...gaze, fov];
  const after = keys.findIndex((key) => key.time >= time);
  if (after === 0) return flat(keys[0]);
  if (after < 0) return flat(keys[keys.length - 1]);
  const [a, b] = [keys[after - 1], keys[after]];
  const share = (time - a.time) / (b.time - a.time);
  const [from, to] = [flat(a), flat(b)];
  return from.map((value, i) => value + share * (to[i] - value));
}

function expectWithinTolerance(keys: readonly CameraKeyframe[], samples: readonly [number, Numbers][]): void {
  for (const [time, numbers] of samples) {
    const actual = interpolated(keys, time);
    const distanceAt = (first: number) =>
      Math.hypot(...[0, 1, 2].map((axis) => actual[first + axis] - numbers[first + axis]));
    expect(distanceAt(0)).toBeLessThan(POSITION_TOLERANCE_M + ROUNDED);
    expect(distanceAt(3)).toBeLessThan(POSITION_TOLERANCE_M + ROUNDED);
    expect(Math.abs(actual[6] - numbers[6])).toBeLessThan(FOV_TOLERANCE_RAD + ROUNDED);
  }
}

const swaying = (t: number): Numbers => [
  Math.sin(t / 3),
  1.4 + 0.1 * Math.sin(t),
  4 + 0.3 * Math.cos(t / 5),
  0.1 * Math.sin(t),
  1,
  0,
  0.45,
];

test("a static camera takes two keyframes, however long", () => {
  const [recorder] = record(20_000, () => [0, 1, 4, 0, 1, 0, 0.45]);
  const keys = recorder.keyframes();
  expect(keys).toEqual(
    [0, 19_999].map((frame) => ({ time: BEGAN + frame * FRAME, position: [0, 1, 4], gaze: [0, 1, 0], fov: 0.45 })),
  );
});

test("a uniform linear move takes two keyframes", () => {
  const [recorder, samples] = record(600, (t) => [t, 1, 4 - 0.1 * t, 0.5 * t, 1, 0, 0.45 + 0.01 * t]);
  expect(recorder.keyframes()).toHaveLength(2);
  expectWithinTolerance(recorder.keyframes(), samples);
});

test("a moving camera is reproduced within tolerance by few keyframes", () => {
  const [recorder, samples] = record(3_600, swaying);
  const keys = recorder.keyframes();
  expectWithinTolerance(keys, samples);
  expect(keys.length).toBeLessThan(3_600 / 8);
});

test("any movement is reproduced, including cuts", () => {
  const step = fc.tuple(
    fc.integer({ min: 1, max: 200_000 }),
    fc.array(fc.double({ min: -0.02, max: 0.02, noNaN: true }), { minLength: 7, maxLength: 7 }),
    fc.nat(30),
  );
  fc.assert(
    fc.property(fc.array(step, { minLength: 1, maxLength: 80 }), (steps) => {
      const recorder = new CameraRecorder();
      const view = createView();
      const samples: [number, Numbers][] = [];
      let time = BEGAN;
      let numbers = [0, 1, 4, 0, 1, 0, 1.5];
      for (const [interval, change, cut] of steps) {
        time += interval;
        numbers = numbers.map((value, i) => Math.round((value + change[i] * (cut === 0 ? 30 : 1)) * 1e4) / 1e4);
        viewFromNumbers(numbers, view);
        recorder.add(time, view);
        samples.push([time, numbers]);
      }
      const keys = recorder.keyframes();
      expect(keys.every((key, i) => i === 0 || key.time > keys[i - 1].time)).toBe(true);
      expectWithinTolerance(keys, samples);
    }),
    { numRuns: 300 },
  );
});

describe("a range of keyframes", () => {
  test("includes the keyframes beside it, so that the camera is known throughout", () => {
    const [recorder, samples] = record(3_600, swaying);
    const [begin, end] = [BEGAN + 20_100_000, BEGAN + 30_300_000];
    const keys = recorder.keyframes(begin, end);
    expect(keys[0].time).toBeLessThanOrEqual(begin);
    expect(keys[1].time).toBeGreaterThan(begin);
    expect(keys.at(-1)!.time).toBeGreaterThanOrEqual(end);
    expect(keys.at(-2)!.time).toBeLessThan(end);
    expectWithinTolerance(
      keys,
      samples.filter(([time]) => time >= begin && time <= end),
    );
  });

  test("before or after all keyframes contains the nearest", () => {
    const [recorder] = record(10, swaying);
    expect(recorder.keyframes(BEGAN + 1e9)).toHaveLength(1);
    expect(recorder.keyframes(0, BEGAN - 1)).toHaveLength(1);
    expect(new CameraRecorder().keyframes()).toEqual([]);
  });
});

test("an untouched view yields no keyframes to keep", () => {
  const recorder = new CameraRecorder();
  const view = createView();
  for (let second = 0; second < 20; second++) recorder.add(BEGAN + second * 1e6, view, second === 7);
  expect(recorder.movedKeyframes()).toEqual(recorder.keyframes());
  expect(recorder.movedKeyframes(BEGAN + 5e6)).toEqual(recorder.keyframes(BEGAN + 5e6));
  expect(recorder.movedKeyframes(BEGAN + 8e6)).toEqual([]);
  recorder.clear();
  recorder.add(BEGAN + 30e6, view, false);
  expect(recorder.movedKeyframes()).toEqual([]);
});

test("keyframes are limited to ten minutes and the maximum count", () => {
  const alternating = (t: number): Numbers => [Math.sin(t * 97), 1, 4, 0, 1, 0, 0.45];
  const [recorder, samples] = record(4_000, alternating, 200_000);
  const keys = recorder.keyframes();
  const last = samples[samples.length - 1][0];
  expect(keys[0].time).toBeLessThanOrEqual(last - MAX_AGE_US + 400_000);
  expect(keys[0].time).toBeGreaterThan(last - MAX_AGE_US - 1_000_000);
  expectWithinTolerance(
    keys,
    samples.filter(([time]) => time >= keys[0].time),
  );
  const [frequent] = record(MAX_KEYFRAMES + 5_000, alternating, 1_000);
  expect(frequent.keyframes().length).toBeLessThanOrEqual(MAX_KEYFRAMES + 1);
});

test("invalid values and earlier times are ignored", () => {
  const [recorder] = record(3, swaying);
  const before = recorder.keyframes();
  const view = createView();
  recorder.add(BEGAN, view);
  viewFromNumbers([NaN, 1, 4, 0, 1, 0, 0.45], view);
  recorder.add(BEGAN + 1e6, view);
  expect(recorder.keyframes()).toEqual(before);
  recorder.clear();
  expect(recorder.keyframes()).toEqual([]);
});

test("ten minutes of constant movement take less than five megabytes", () => {
  setFlagsFromString("--expose-gc");
  const collect = runInNewContext("gc") as () => void;
  const heapBytes = () => {
    collect();
    const { heapUsed, external } = process.memoryUsage();
    return heapUsed + external;
  };
  const view = createView();
  // The median of several: what other files of this thread have left is freed at any time.
  const growths = Array.from({ length: 5 }, () => {
    const before = heapBytes();
    const recorder = new CameraRecorder();
    // Alternating sides: each frame is a keyframe.
    for (let frame = 0; frame < MAX_KEYFRAMES + 1000; frame++) {
      viewFromNumbers([frame % 2, 1, 4, 0, 1, 0, 0.45], view);
      recorder.add(BEGAN + frame * FRAME, view);
    }
    const growth = heapBytes() - before;
    expect(recorder.keyframes().length).toBeGreaterThan(MAX_KEYFRAMES - 10);
    return growth;
  }).sort((a, b) => a - b);
  expect(growths[2]).toBeLessThan(5e6);
  expect(growths[2]).toBeGreaterThan(1e5);
});
