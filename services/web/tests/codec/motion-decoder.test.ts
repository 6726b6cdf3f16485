import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import { DamagedBlock } from "../../src/codec/errors";
import { decodeMotionBlock, reconstruct, stepSize } from "../../src/codec/motion-decoder";
import type { MotionTrack } from "../../src/codec/motion-track";
import { restPose } from "../../src/motion/skeleton";
import { type BlockVectors, goldenTrack } from "../golden-motion";
import { decodeBase64, loadVectors } from "../golden-vectors";
import { HostileInputCounts } from "../hostile-input";

const golden = loadVectors<BlockVectors>("blocks");
const tracks = golden.tracks.map((_, index) => goldenTrack(index));

describe("golden blocks", () => {
  test.each(golden.valid)("step $step: poses to 1e-9", (vector) => {
    const block = decodeMotionBlock(tracks[vector.track], decodeBase64(vector.block));
    expect(block.frames).toBe(vector.frames);
    const pose = restPose();
    for (const { instant, root, rotations } of vector.poses) {
      block.poseAt(instant, pose);
      // relative error for values of kilometres
      root.forEach((value, i) =>
        expect(Math.abs(pose.root[i] - value)).toBeLessThan(1e-9 * Math.max(1, Math.abs(value))),
      );
      rotations.forEach((value, i) => expect(Math.abs(pose.rotations[i] - value)).toBeLessThan(1e-9));
    }
  });

  test.each(golden.invalid)("refuses: $why", (vector) => {
    expect(() => decodeMotionBlock(tracks[0], decodeBase64(vector.block))).toThrow(DamagedBlock);
  });
});

test("step size doubles every 16 indices, and with four times the frames", () => {
  expect([stepSize(0, 30), stepSize(16, 30), stepSize(160, 30), stepSize(0, 120)]).toEqual([
    2 ** -16,
    2 ** -15,
    2 ** -6,
    2 ** -15,
  ]);
});

test("reconstruction is biased towards zero", () => {
  expect([0, 1, -1, 2, -2, 9].map(reconstruct)).toEqual([0, 0.94, -0.94, 1.97, -1.97, 8.97]);
});

const outcome = new HostileInputCounts(DamagedBlock);

/** Decodes `data` and evaluates a pose. Only `DamagedBlock` may be thrown, and at most a megabyte allocated. */
function expectNoCrash(track: MotionTrack, data: Uint8Array): void {
  outcome.run(() => {
    const block = decodeMotionBlock(track, data);
    if (block.values.byteLength + block.reference.byteLength > 1_000_000) throw new Error("a block above a megabyte");
    const pose = restPose();
    block.poseAt(block.frames / 2, pose);
    if (![...pose.root, ...pose.rotations].every(Number.isFinite)) throw new Error("a pose that is not finite");
  });
}

describe("damaged block decodes to finite poses or is refused", { timeout: 60_000 }, () => {
  const blocks = golden.valid.map((vector) => ({ track: tracks[vector.track], valid: decodeBase64(vector.block) }));
  const anyBlock = fc.constantFrom(...blocks);

  test("truncated blocks", () => {
    fc.assert(
      fc.property(anyBlock, fc.double({ min: 0, max: 1, noNaN: true }), ({ track, valid }, part) => {
        expectNoCrash(track, valid.subarray(0, Math.floor(part * valid.length)));
      }),
      { numRuns: 1000 },
    );
  });

  test("blocks with changed bytes", () => {
    const change = fc.tuple(fc.nat(), fc.nat(255));
    fc.assert(
      fc.property(anyBlock, fc.array(change, { minLength: 1, maxLength: 8 }), ({ track, valid }, changes) => {
        const damaged = valid.slice();
        for (const [position, value] of changes) damaged[position % damaged.length] = value;
        expectNoCrash(track, damaged);
      }),
      { numRuns: 2000 },
    );
  });

  test("random bytes", () => {
    fc.assert(
      fc.property(fc.constantFrom(...tracks), fc.uint8Array({ maxLength: 600 }), (track, data) =>
        expectNoCrash(track, data),
      ),
      { numRuns: 2000 },
    );
  });

  test("blocks of the maximum length", () => {
    const noise = new Uint8Array(65_536).map((_, i) => (i * 2_654_435_761) >>> 11);
    for (let first = 0; first < 256; first++) {
      noise[0] = first;
      expectNoCrash(tracks[first % tracks.length], noise);
    }
    outcome.print("blocks");
  });
});

test("too long block is refused", () => {
  expect(() => decodeMotionBlock(tracks[0], new Uint8Array(65_537).fill(1))).toThrow("at most 65536");
});
