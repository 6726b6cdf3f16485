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
const tracks = golden.tracks.map((_, which) => goldenTrack(which));

describe("golden blocks", () => {
  test.each(golden.valid)("step $step: poses to 1e-9", (vector) => {
    const block = decodeMotionBlock(tracks[vector.track], decodeBase64(vector.block));
    expect(block.frames).toBe(vector.frames);
    const pose = restPose();
    for (const { instant, root, rotations } of vector.poses) {
      block.poseAt(instant, pose);
      // of values as large as whole kilometres, in parts of them
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

test("sixteen step indices double the step, and a block of 120 frames has twice that of 30", () => {
  expect([stepSize(0, 30), stepSize(16, 30), stepSize(160, 30), stepSize(0, 120)]).toEqual([
    2 ** -16,
    2 ** -15,
    2 ** -6,
    2 ** -15,
  ]);
});

test("values lie a little towards zero", () => {
  expect([0, 1, -1, 2, -2, 9].map(reconstruct)).toEqual([0, 0.94, -0.94, 1.97, -1.97, 8.97]);
});

const outcome = new HostileInputCounts(DamagedBlock);

/** Decodes `data` and takes a pose; only `DamagedBlock` may come of it, and never more than a megabyte. */
function expectNoCrash(track: MotionTrack, data: Uint8Array): void {
  outcome.run(() => {
    const block = decodeMotionBlock(track, data);
    if (block.values.byteLength + block.reference.byteLength > 1_000_000) throw new Error("a block above a megabyte");
    const pose = restPose();
    block.poseAt(block.frames / 2, pose);
    if (![...pose.root, ...pose.rotations].every(Number.isFinite)) throw new Error("a pose that is not finite");
  });
}

describe("what is no block decodes to finite poses or is refused", { timeout: 60_000 }, () => {
  const blocks = golden.valid.map((vector) => ({ track: tracks[vector.track], whole: decodeBase64(vector.block) }));
  const anyBlock = fc.constantFrom(...blocks);

  test("blocks cut short", () => {
    fc.assert(
      fc.property(anyBlock, fc.double({ min: 0, max: 1, noNaN: true }), ({ track, whole }, part) => {
        expectNoCrash(track, whole.subarray(0, Math.floor(part * whole.length)));
      }),
      { numRuns: 1000 },
    );
  });

  test("blocks with bytes changed", () => {
    const change = fc.tuple(fc.nat(), fc.nat(255));
    fc.assert(
      fc.property(anyBlock, fc.array(change, { minLength: 1, maxLength: 8 }), ({ track, whole }, changes) => {
        const damaged = whole.slice();
        for (const [where, value] of changes) damaged[where % damaged.length] = value;
        expectNoCrash(track, damaged);
      }),
      { numRuns: 2000 },
    );
  });

  test("any bytes", () => {
    fc.assert(
      fc.property(fc.constantFrom(...tracks), fc.uint8Array({ maxLength: 600 }), (track, data) =>
        expectNoCrash(track, data),
      ),
      { numRuns: 2000 },
    );
  });

  test("a whole length of noise, and one of the longest blocks", () => {
    const noise = new Uint8Array(65_536).map((_, i) => (i * 2_654_435_761) >>> 11);
    for (let first = 0; first < 256; first++) {
      noise[0] = first;
      expectNoCrash(tracks[first % tracks.length], noise);
    }
    outcome.print("blocks");
  });
});

test("a block past the limit is refused before it is read", () => {
  expect(() => decodeMotionBlock(tracks[0], new Uint8Array(65_537).fill(1))).toThrow("at most 65536 bytes");
});
