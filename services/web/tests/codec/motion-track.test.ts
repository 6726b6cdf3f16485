import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import { DamagedBlock } from "../../src/codec/errors";
import { MotionTrack } from "../../src/codec/motion-track";
import { fromRotationVector, multiply, rotate } from "../../src/motion/rotation";
import { goldenDescription, goldenTrack } from "../golden-motion";
import { HostileInputCounts } from "../hostile-input";

test("blocks are found by time at any frame rate and first length", () => {
  const { skeleton } = goldenTrack();
  for (const fps of [24, 29.97, 30, 59.94, 60, 119.88, 120]) {
    for (const first of [1, 6, Math.round(fps), Math.round(fps * 3), Math.round(fps * 9.5)]) {
      const track = new MotionTrack(fps, Math.round(fps * 9.5), Math.round(fps), first, skeleton);
      for (let index = 0; index < track.blockCount; index++) {
        expect(track.blockAt(track.startUs(index))).toBe(index);
        if (index > 0) expect(track.blockAt(track.startUs(index) - 1e3)).toBe(index - 1);
        expect(track.firstFrame(index)).toBe(index > 0 ? track.firstFrame(index - 1) + track.framesIn(index - 1) : 0);
      }
      expect(track.blockAt(-5)).toBe(0);
      expect(track.blockAt(1e12)).toBe(track.blockCount - 1);
      const frames = Array.from({ length: track.blockCount }, (_, index) => track.framesIn(index));
      expect(Math.min(...frames)).toBeGreaterThan(0);
      expect(frames.reduce((sum, count) => sum + count)).toBe(track.frames);
    }
  }
});

test("heading rotates only the root's reference, by 1/64 of a turn about y", () => {
  const track = goldenTrack(1);
  const { reference } = track.skeleton;
  expect([...track.referenceRotations(0)]).toEqual([...reference]);
  for (const heading of [-32, -7, 16, 31]) {
    const rotated = track.referenceRotations(heading);
    expect([...rotated.subarray(4)]).toEqual([...reference.subarray(4)]);
    const turn = new Float64Array(4),
      expected = new Float64Array(4);
    fromRotationVector(turn, 0, 0, (heading * Math.PI) / 32, 0);
    multiply(expected, 0, turn, 0, reference, 0);
    expected.forEach((value, i) => expect(rotated[i]).toBeCloseTo(value, 12));
  }
  // a quarter turn moves the z axis to the x axis
  const [before, after] = [new Float64Array(3), new Float64Array(3)];
  rotate(before, 0, reference, 0, Float64Array.of(0, 0, 1), 0);
  rotate(after, 0, track.referenceRotations(16), 0, Float64Array.of(0, 0, 1), 0);
  [before[2], before[1], -before[0]].forEach((value, i) => expect(after[i]).toBeCloseTo(value, 12));
});

test("blocks of the golden tracks", () => {
  const lengths = [0, 1, 2].map((index) => {
    const track = goldenTrack(index);
    return Array.from({ length: track.blockCount }, (_, index) => track.framesIn(index));
  });
  expect(lengths).toEqual([[30, 30, 18], [6, 30, 30], [20]]);
});

describe("invalid description is refused with a reason", () => {
  test.each([
    [{ codec: "bunraku.motion/1" }, "codec bunraku.motion/1"],
    [{ fps: 0 }, "fps"],
    [{ fps: NaN }, "fps"],
    [{ fps: 1e6 }, "fps"],
    [{ fps: 5e-324 }, "2^48"],
    [{ fps: "60" }, "fps"],
    [{ block_frames: 0 }, "block_frames"],
    [{ block_frames: 513 }, "block_frames"],
    [{ first_frames: 0 }, "first_frames"],
    [{ first_frames: 79 }, "first_frames"],
    [{ first_frames: undefined }, "first_frames"],
    [{ frames: 1e12 }, "frames"],
    [{ frames: 2.5 }, "frames"],
    [{ dancer: "text" }, "dancer"],
    [{ dancer: new Uint8Array(0) }, "bytes"],
    [{ dancer: new Uint8Array(103).fill(15) }, "15 reference bits"],
    [{ dancer: new Uint8Array(103).fill(0x82) }, "grid 8"],
    [{ rates: Array(17).fill({ kbps: 1, mean: 1, max: 1 }) }, "rates"],
    [{ rates: [{ kbps: 1, mean: 1 }] }, "rate 0"],
    [{ place: null }, "place must have three numbers"],
    [{ place: [0, 0] }, "place must have three numbers"],
    [{ place: [0, 0, 0, 0] }, "place must have three numbers"],
    [{ place: [0, NaN, 0] }, "place must have three numbers"],
    [{ place: [0, 0, Infinity] }, "place must have three numbers"],
    [{ place: [0, "1", 0] }, "place must have three numbers"],
    [{ place: { x: 0, z: 0, turn: 0 } }, "place must have three numbers"],
    [{ place: [100.001, 0, 0] }, "within 100 metres"],
    [{ place: [0, -101, 0] }, "within 100 metres"],
  ])("%o", (change, message) => {
    const parse = () => MotionTrack.fromDescription({ ...goldenDescription(), ...change });
    expect(parse).toThrow(DamagedBlock);
    expect(parse).toThrow(message);
  });
});

test("placement is parsed, and is the centre of the stage by default", () => {
  const placementOf = (place: unknown) => MotionTrack.fromDescription({ ...goldenDescription(), place }).placement;
  expect(placementOf([-100, 1.5, -2])).toEqual({ x: -100, z: 1.5, turn: -2 });
  expect(goldenTrack().placement).toEqual({ x: 0, z: 0, turn: 0 });
});

test("arbitrary description gives a valid track or is refused", () => {
  const value = fc.oneof(
    fc.anything(),
    fc.double(),
    fc.double({ min: 0, max: 1e-300 }),
    fc.integer(),
    fc.integer({ min: 0, max: 2000 }),
    fc.uint8Array(),
  );
  const changes = fc.dictionary(fc.constantFrom("place", ...Object.keys(goldenDescription())), value, { maxKeys: 3 });
  const outcome = new HostileInputCounts(DamagedBlock);
  fc.assert(
    fc.property(fc.nat(2), changes, (which, change) => {
      outcome.run(() => {
        const track = MotionTrack.fromDescription({ ...goldenDescription(which), ...change });
        const last = track.blockCount - 1;
        expect(track.durationUs).toBeLessThan(2 ** 48);
        expect(track.framesIn(last)).toBeGreaterThan(0);
        expect(Math.max(Math.abs(track.placement.x), Math.abs(track.placement.z))).toBeLessThanOrEqual(100);
        expect(track.blockAt(track.startUs(last))).toBe(last);
      });
    }),
    { numRuns: 3000 },
  );
  outcome.print("descriptions");
});
