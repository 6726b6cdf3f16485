import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import { decodeBlock } from "../../src/codec/decode";
import { DamagedBlock } from "../../src/codec/errors";
import { restPose } from "../../src/motion/skeleton";
import { type BlockVectors, goldenTrack } from "../golden";
import { bytes, vectors } from "../vectors";

const golden = vectors<BlockVectors>("blocks");
const track = goldenTrack();

describe("golden blocks", () => {
  test.each(golden.valid)("step $step: the same coefficients, and poses to 1e-9", (vector) => {
    const block = decodeBlock(track, bytes(vector.block));
    expect(block.frames).toBe(vector.frames);
    expect([...block.q]).toEqual(vector.q);
    const pose = restPose();
    for (const { instant, root, rotations } of vector.poses) {
      block.at(instant, pose);
      root.forEach((value, i) => expect(Math.abs(pose.root[i] - value)).toBeLessThan(1e-9));
      rotations.forEach((value, i) => expect(Math.abs(pose.rotations[i] - value)).toBeLessThan(1e-9));
    }
  });

  test.each(golden.invalid)("refuses: $why", (vector) => {
    expect(() => decodeBlock(track, bytes(vector.block))).toThrow(DamagedBlock);
  });
});

test("a block cut short still decodes or is refused", () => {
  const whole = bytes(golden.valid[0].block);
  fc.assert(
    fc.property(fc.nat(whole.length), (length) => {
      survives(whole.subarray(0, length));
    }),
  );
});

test("a block with bytes changed decodes to finite poses or is refused", () => {
  const blocks = golden.valid.map((vector) => bytes(vector.block));
  const change = fc.tuple(fc.nat(), fc.nat(255));
  fc.assert(
    fc.property(fc.constantFrom(...blocks), fc.array(change, { minLength: 1, maxLength: 8 }), (block, changes) => {
      const damaged = block.slice();
      for (const [where, value] of changes) damaged[where % damaged.length] = value;
      survives(damaged);
    }),
    { numRuns: 300 },
  );
});

test("any bytes behind a sound header decode to finite poses or are refused", () => {
  fc.assert(
    fc.property(fc.integer({ min: 1, max: 1000 }), fc.uint8Array({ maxLength: 400 }), (frames, rest) => {
      survives(Uint8Array.of(1, 9, frames & 255, frames >> 8, 0, 0, 0, ...rest));
    }),
    { numRuns: 300 },
  );
});

test("a block past the limit is refused before it is read", () => {
  expect(() => decodeBlock(track, new Uint8Array(65_537).fill(1))).toThrow("7..65536 bytes");
});

/** Decodes `data` and takes a pose; only `DamagedBlock` may come of it. */
function survives(data: Uint8Array): void {
  try {
    const block = decodeBlock(track, data);
    const pose = restPose();
    block.at(block.frames / 2, pose);
    expect([...pose.root, ...pose.rotations].every(Number.isFinite)).toBe(true);
  } catch (error) {
    expect(error).toBeInstanceOf(DamagedBlock);
  }
}
