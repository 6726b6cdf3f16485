import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import { DamagedBlock } from "../../src/codec/errors";
import { MotionTrack } from "../../src/codec/motion-track";
import { fromRotationVector, multiply, rotate } from "../../src/motion/rotation";
import { goldenDescription, goldenTrack } from "../golden-motion";
import { HostileInputCounts } from "../hostile-input";

test("blocks are found by time, whatever the rounding and the length of the first", () => {
  const { skeleton: dancer } = goldenTrack();
  for (const fps of [24, 29.97, 30, 59.94, 60, 119.88, 120]) {
    for (const first of [1, 6, Math.round(fps), Math.round(fps * 3), Math.round(fps * 9.5)]) {
      const track = new MotionTrack(fps, Math.round(fps * 9.5), Math.round(fps), first, dancer);
      for (let index = 0; index < track.blockCount; index++) {
        expect(track.blockAt(track.startUs(index))).toBe(index);
        if (index > 0) expect(track.blockAt(track.startUs(index) - 1e3)).toBe(index - 1);
        expect(track.firstFrame(index)).toBe(index > 0 ? track.firstFrame(index - 1) + track.framesIn(index - 1) : 0);
      }
      expect(track.blockAt(-5)).toBe(0);
      expect(track.blockAt(1e12)).toBe(track.blockCount - 1);
      const frames = Array.from({ length: track.blockCount }, (_, index) => track.framesIn(index));
      expect(Math.min(...frames)).toBeGreaterThan(0);
      expect(frames.reduce((sum, each) => sum + each)).toBe(track.frames);
    }
  }
});

test("a heading turns the root's reference about y by sixty-fourths, and no other", () => {
  const track = goldenTrack(1);
  const { reference } = track.skeleton;
  expect([...track.referenceRotations(0)]).toEqual([...reference]);
  for (const heading of [-32, -7, 16, 31]) {
    const turned = track.referenceRotations(heading);
    expect([...turned.subarray(4)]).toEqual([...reference.subarray(4)]);
    const turn = new Float64Array(4),
      wanted = new Float64Array(4);
    fromRotationVector(turn, 0, 0, (heading * Math.PI) / 32, 0);
    multiply(wanted, 0, turn, 0, reference, 0);
    wanted.forEach((value, i) => expect(turned[i]).toBeCloseTo(value, 12));
  }
  // a quarter of a whole turn brings what pointed along z along x
  const [before, after] = [new Float64Array(3), new Float64Array(3)];
  rotate(before, 0, reference, 0, Float64Array.of(0, 0, 1), 0);
  rotate(after, 0, track.referenceRotations(16), 0, Float64Array.of(0, 0, 1), 0);
  [before[2], before[1], -before[0]].forEach((value, i) => expect(after[i]).toBeCloseTo(value, 12));
});

test("the golden tracks' blocks", () => {
  const lengths = [0, 1, 2].map((which) => {
    const track = goldenTrack(which);
    return Array.from({ length: track.blockCount }, (_, index) => track.framesIn(index));
  });
  expect(lengths).toEqual([[30, 30, 18], [6, 30, 30], [20]]);
});

describe("a description that cannot be played is refused with what it lacks", () => {
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
    [{ dancer: new Uint8Array(103).fill(15) }, "2^-15 radians"],
    [{ dancer: new Uint8Array(103).fill(0x82) }, "grid is 8"],
    [{ rates: Array(17).fill({ kbps: 1, mean: 1, max: 1 }) }, "rates"],
    [{ rates: [{ kbps: 1, mean: 1 }] }, "rate 0"],
    [{ place: null }, "place of three numbers"],
    [{ place: [0, 0] }, "place of three numbers"],
    [{ place: [0, 0, 0, 0] }, "place of three numbers"],
    [{ place: [0, NaN, 0] }, "place of three numbers"],
    [{ place: [0, 0, Infinity] }, "place of three numbers"],
    [{ place: [0, "1", 0] }, "place of three numbers"],
    [{ place: { x: 0, z: 0, turn: 0 } }, "place of three numbers"],
    [{ place: [100.001, 0, 0] }, "within 100 metres"],
    [{ place: [0, -101, 0] }, "within 100 metres"],
  ])("%o", (change, what) => {
    const read = () => MotionTrack.fromDescription({ ...goldenDescription(), ...change });
    expect(read).toThrow(DamagedBlock);
    expect(read).toThrow(what);
  });
});

test("where its dancer dances is read; left out it is the middle", () => {
  const place = (given: unknown) => MotionTrack.fromDescription({ ...goldenDescription(), place: given }).placement;
  expect(place([-100, 1.5, -2])).toEqual({ x: -100, z: 1.5, turn: -2 });
  expect(goldenTrack().placement).toEqual({ x: 0, z: 0, turn: 0 });
});

test("a description with anything in it is of a track whose every block has its place, or refused", () => {
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
