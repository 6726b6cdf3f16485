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
/** Half of what keyframes are rounded to. */
const ROUNDED = 0.5e-4 * Math.sqrt(3);

type Numbers = number[];

/** A trail of `frames` frames of a camera that stands at `at(seconds)`, and what was seen. */
function recorded(
  frames: number,
  at: (seconds: number) => Numbers,
  every = FRAME,
): [CameraRecorder, [number, Numbers][]] {
  const trail = new CameraRecorder();
  const view = createView();
  const seen: [number, Numbers][] = [];
  for (let frame = 0; frame < frames; frame++) {
    const numbers = at((frame * every) / 1e6);
    viewFromNumbers(numbers, view);
    trail.add(BEGAN + frame * every, view);
    seen.push([BEGAN + frame * every, numbers]);
  }
  return [trail, seen];
}

/** The line between keyframes at a time, as a kept session has it. */
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

function expectFollowed(keys: readonly CameraKeyframe[], seen: readonly [number, Numbers][]): void {
  for (const [time, numbers] of seen) {
    const got = interpolated(keys, time);
    const off = (first: number) => Math.hypot(...[0, 1, 2].map((axis) => got[first + axis] - numbers[first + axis]));
    expect(off(0)).toBeLessThan(POSITION_TOLERANCE_M + ROUNDED);
    expect(off(3)).toBeLessThan(POSITION_TOLERANCE_M + ROUNDED);
    expect(Math.abs(got[6] - numbers[6])).toBeLessThan(FOV_TOLERANCE_RAD + ROUNDED);
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

test("a camera that stands still is two keyframes, however long", () => {
  const [trail] = recorded(20_000, () => [0, 1, 4, 0, 1, 0, 0.45]);
  const keys = trail.keyframes();
  expect(keys).toEqual(
    [0, 19_999].map((frame) => ({ time: BEGAN + frame * FRAME, position: [0, 1, 4], gaze: [0, 1, 0], fov: 0.45 })),
  );
});

test("a straight even move is two keyframes", () => {
  const [trail, seen] = recorded(600, (t) => [t, 1, 4 - 0.1 * t, 0.5 * t, 1, 0, 0.45 + 0.01 * t]);
  expect(trail.keyframes()).toHaveLength(2);
  expectFollowed(trail.keyframes(), seen);
});

test("a moving camera is followed within two millimetres and 0.2 degrees, by few keyframes", () => {
  const [trail, seen] = recorded(3_600, swaying);
  const keys = trail.keyframes();
  expectFollowed(keys, seen);
  expect(keys.length).toBeLessThan(3_600 / 8);
});

test("any movement is followed, cuts too", () => {
  const step = fc.tuple(
    fc.integer({ min: 1, max: 200_000 }),
    fc.array(fc.double({ min: -0.02, max: 0.02, noNaN: true }), { minLength: 7, maxLength: 7 }),
    fc.nat(30),
  );
  fc.assert(
    fc.property(fc.array(step, { minLength: 1, maxLength: 80 }), (steps) => {
      const trail = new CameraRecorder();
      const view = createView();
      const seen: [number, Numbers][] = [];
      let time = BEGAN;
      let numbers = [0, 1, 4, 0, 1, 0, 1.5];
      for (const [passed, change, cut] of steps) {
        time += passed;
        numbers = numbers.map((value, i) => Math.round((value + change[i] * (cut === 0 ? 30 : 1)) * 1e4) / 1e4);
        viewFromNumbers(numbers, view);
        trail.add(time, view);
        seen.push([time, numbers]);
      }
      const keys = trail.keyframes();
      expect(keys.every((key, i) => i === 0 || key.time > keys[i - 1].time)).toBe(true);
      expectFollowed(keys, seen);
    }),
    { numRuns: 300 },
  );
});

describe("a part of it", () => {
  test("has the keyframes beside it too, so that the camera is known all along", () => {
    const [trail, seen] = recorded(3_600, swaying);
    const [begin, end] = [BEGAN + 20_100_000, BEGAN + 30_300_000];
    const keys = trail.keyframes(begin, end);
    expect(keys[0].time).toBeLessThanOrEqual(begin);
    expect(keys[1].time).toBeGreaterThan(begin);
    expect(keys.at(-1)!.time).toBeGreaterThanOrEqual(end);
    expect(keys.at(-2)!.time).toBeLessThan(end);
    expectFollowed(
      keys,
      seen.filter(([time]) => time >= begin && time <= end),
    );
  });

  test("before and after all is what is nearest", () => {
    const [trail] = recorded(10, swaying);
    expect(trail.keyframes(BEGAN + 1e9)).toHaveLength(1);
    expect(trail.keyframes(0, BEGAN - 1)).toHaveLength(1);
    expect(new CameraRecorder().keyframes()).toEqual([]);
  });
});

test("a camera that was not moved has nothing to keep", () => {
  const trail = new CameraRecorder();
  const view = createView();
  for (let second = 0; second < 20; second++) trail.add(BEGAN + second * 1e6, view, second === 7);
  expect(trail.movedKeyframes()).toEqual(trail.keyframes());
  expect(trail.movedKeyframes(BEGAN + 5e6)).toEqual(trail.keyframes(BEGAN + 5e6));
  expect(trail.movedKeyframes(BEGAN + 8e6)).toEqual([]);
  trail.clear();
  trail.add(BEGAN + 30e6, view, false);
  expect(trail.movedKeyframes()).toEqual([]);
});

test("ten minutes are remembered and no more, and never more keyframes than may be kept", () => {
  const restless = (t: number): Numbers => [Math.sin(t * 97), 1, 4, 0, 1, 0, 0.45];
  const [trail, seen] = recorded(4_000, restless, 200_000);
  const keys = trail.keyframes();
  const last = seen[seen.length - 1][0];
  expect(keys[0].time).toBeLessThanOrEqual(last - MAX_AGE_US + 400_000);
  expect(keys[0].time).toBeGreaterThan(last - MAX_AGE_US - 1_000_000);
  expectFollowed(
    keys,
    seen.filter(([time]) => time >= keys[0].time),
  );
  const [quick] = recorded(MAX_KEYFRAMES + 5_000, restless, 1_000);
  expect(quick.keyframes().length).toBeLessThanOrEqual(MAX_KEYFRAMES + 1);
});

test("what cannot be a camera, and a time that runs back, are passed over", () => {
  const [trail] = recorded(3, swaying);
  const before = trail.keyframes();
  const view = createView();
  trail.add(BEGAN, view);
  viewFromNumbers([NaN, 1, 4, 0, 1, 0, 0.45], view);
  trail.add(BEGAN + 1e6, view);
  expect(trail.keyframes()).toEqual(before);
  trail.clear();
  expect(trail.keyframes()).toEqual([]);
});

test("ten minutes of a camera that never rests take less than five megabytes", () => {
  setFlagsFromString("--expose-gc");
  const collect = runInNewContext("gc") as () => void;
  const held = () => {
    collect();
    const { heapUsed, external } = process.memoryUsage();
    return heapUsed + external;
  };
  const view = createView();
  const trail = new CameraRecorder();
  const before = held();
  // from side to side: each frame is a keyframe
  for (let frame = 0; frame < MAX_KEYFRAMES + 1000; frame++) {
    viewFromNumbers([frame % 2, 1, 4, 0, 1, 0, 0.45], view);
    trail.add(BEGAN + frame * FRAME, view);
  }
  expect(held() - before).toBeLessThan(5e6);
  expect(trail.keyframes().length).toBeGreaterThan(MAX_KEYFRAMES - 10);
});
