import { describe, expect, test } from "vitest";
import { DamagedBlock } from "../../src/codec/errors";
import { MotionTrack, unpackFigure, unpackReference } from "../../src/codec/track";
import { type BlockVectors, goldenDescription, goldenTrack } from "../golden";
import { vectors } from "../vectors";

const golden = vectors<BlockVectors>("blocks").track;

test("the golden track's levers to 1e-12", () => {
  const { levers } = goldenTrack();
  golden.levers.forEach((lever, channel) => expect(levers[channel]).toBeCloseTo(lever, 12));
});

test("figure and reference are read in their units", () => {
  const data = new Uint8Array(138);
  new DataView(data.buffer).setInt16(2, -8240, true);
  new DataView(data.buffer).setInt16(2 * (18 * 3 + 3), 1234, true);
  const figure = unpackFigure(data);
  expect(figure.offsets[1]).toBeCloseTo(-0.824, 12);
  expect(figure.tips[14 * 3]).toBeCloseTo(0.1234, 12);
  const turned = new Uint8Array(51);
  new Int8Array(turned.buffer)[0] = -127;
  const reference = unpackReference(turned);
  expect(reference[5]).toBeCloseTo(-1, 12);
  expect([...reference.subarray(0, 4), ...reference.subarray(8, 12)]).toEqual([1, 0, 0, 0, 1, 0, 0, 0]);
});

test("blocks are found by time, whatever the rounding", () => {
  for (const fps of [24, 29.97, 30, 59.94, 60, 119.88, 120]) {
    const track = new MotionTrack(fps, Math.round(fps * 9.5), Math.round(fps), goldenTrack().figure, goldenTrack().reference);
    for (let index = 0; index < track.blocks; index++) expect(track.blockAt(track.startUs(index))).toBe(index);
    expect(track.blockAt(-5)).toBe(0);
    expect(track.blockAt(1e12)).toBe(track.blocks - 1);
    const frames = Array.from({ length: track.blocks }, (_, index) => track.framesIn(index));
    expect(frames.reduce((sum, each) => sum + each)).toBe(track.frames);
  }
});

describe("a description that cannot be played is refused with what it lacks", () => {
  test.each([
    [{ codec: "bunraku.motion/2" }, "codec bunraku.motion/2"],
    [{ fps: 0 }, "fps"],
    [{ fps: NaN }, "fps"],
    [{ fps: "60" }, "fps"],
    [{ block_frames: 0 }, "block_frames"],
    [{ block_frames: 1001 }, "block_frames"],
    [{ frames: 1e12 }, "frames"],
    [{ frames: 2.5 }, "frames"],
    [{ figure: "text" }, "figure"],
    [{ reference: new Uint8Array(50) }, "51 bytes"],
    [{ rates: Array(17).fill({ kbps: 1, mean: 1, max: 1 }) }, "rates"],
    [{ rates: [{ kbps: 1, mean: 1 }] }, "rate 0"],
  ])("%o", (change, what) => {
    const read = () => MotionTrack.fromDescription({ ...goldenDescription(), ...change });
    expect(read).toThrow(DamagedBlock);
    expect(read).toThrow(what);
  });
});
