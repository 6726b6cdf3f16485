import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import { DamagedBlock } from "../../src/codec/errors";
import { parseLadder, parseTiming, Timing } from "../../src/codec/timing";

test("blocks tile any track and are found by time", () => {
  fc.assert(
    fc.property(
      fc.double({ min: 1, max: 240, noNaN: true }),
      fc.integer({ min: 1, max: 5000 }),
      fc.integer({ min: 1, max: 512 }),
      fc.integer({ min: 1, max: 512 }),
      (fps, frames, blockFrames, first) => {
        const timing = new Timing(fps, frames, blockFrames, Math.min(first, frames));
        let sum = 0;
        for (let index = 0; index < timing.blockCount; index++) {
          expect(timing.firstFrame(index)).toBe(sum);
          expect(timing.framesIn(index)).toBeGreaterThan(0);
          expect(timing.blockAt(timing.startUs(index))).toBe(index);
          sum += timing.framesIn(index);
        }
        expect(sum).toBe(frames);
        expect(timing.blockAt(-5)).toBe(0);
        expect(timing.blockAt(timing.durationUs * 2)).toBe(timing.blockCount - 1);
      },
    ),
  );
});

const described = {
  fps: 29.97,
  frames: 90,
  block_frames: 30,
  first_frames: 15,
  rates: [{ kbps: 1, mean: 2, max: 3, more: 4 }],
};

test("a track's timing and rates are read", () => {
  expect(parseTiming(described, "light")).toEqual(new Timing(29.97, 90, 30, 15));
  expect(parseLadder(described, "light")).toEqual([{ kbps: 1, mean: 2, max: 3 }]);
});

describe("what is no timing is refused, with the track's name", () => {
  test.each([
    [{ fps: Infinity }, "light needs fps"],
    [{ fps: "30" }, "light needs fps"],
    [{ block_frames: 513 }, "light needs block_frames"],
    [{ frames: 0 }, "light needs frames"],
    [{ frames: 1e12 }, "light needs frames"],
    [{ first_frames: 91 }, "light needs first_frames"],
    [{ rates: null }, "light needs rates"],
    [{ rates: [null] }, "rate 0"],
  ])("%o", (change, what) => {
    const read = () => [
      parseTiming({ ...described, ...change }, "light"),
      parseLadder({ ...described, ...change }, "light"),
    ];
    expect(read).toThrow(DamagedBlock);
    expect(read).toThrow(what);
  });
});
