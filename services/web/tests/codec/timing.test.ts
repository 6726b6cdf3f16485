import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import { DamagedBlock } from "../../src/codec/errors";
import { parseLadder, parseTiming, Timing } from "../../src/codec/timing";

test("blocks cover the track and are found by time", () => {
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

const description = {
  fps: 29.97,
  frames: 90,
  block_frames: 30,
  first_frames: 15,
  rates: [{ kbps: 1, mean: 2, max: 3, more: 4 }],
};

test("timing and bitrate levels are parsed", () => {
  expect(parseTiming(description, "light")).toEqual(new Timing(29.97, 90, 30, 15));
  expect(parseLadder(description, "light")).toEqual([{ kbps: 1, mean: 2, max: 3 }]);
});

describe("invalid timing or ladder is refused with the name of the track", () => {
  test.each([
    [{ fps: Infinity }, "light track: fps"],
    [{ fps: "30" }, "light track: fps"],
    [{ block_frames: 513 }, "light track: block_frames"],
    [{ frames: 0 }, "light track: frames"],
    [{ frames: 1e12 }, "light track: frames"],
    [{ first_frames: 91 }, "light track: first_frames"],
    [{ rates: null }, "light track: rates"],
    [{ rates: [null] }, "rate 0"],
  ])("%o", (change, message) => {
    const parse = () => [
      parseTiming({ ...description, ...change }, "light"),
      parseLadder({ ...description, ...change }, "light"),
    ];
    expect(parse).toThrow(DamagedBlock);
    expect(parse).toThrow(message);
  });
});
