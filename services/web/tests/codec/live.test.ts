import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import { decodeCoefficients } from "../../src/codec/coefficients";
import { DamagedBlock } from "../../src/codec/errors";
import { LIVE_FPS, LiveTrack } from "../../src/codec/live";
import { loadShippedPrior } from "../../src/codec/prior";
import { restPose } from "../../src/motion/skeleton";
import { goldenLiveTrack, type LiveVectors } from "../golden-live";
import { decodeBase64, loadVectors } from "../golden-vectors";
import { HostileInputCounts } from "../hostile-input";

const golden = loadVectors<LiveVectors>("live");
const track = new LiveTrack(goldenLiveTrack());

describe("golden live blocks", () => {
  test.each(golden.valid)("$frames frames, step $step: coefficients, and poses to 1e-9", (vector) => {
    const data = decodeBase64(vector.block);
    const decoded = decodeCoefficients(loadShippedPrior(), data, vector.frames, LIVE_FPS);
    expect([decoded.frames, decoded.step, decoded.heading]).toEqual([vector.frames, vector.step, vector.heading]);
    expect([...decoded.q]).toEqual(vector.q);
    const block = track.decode(vector.frames, data);
    const pose = restPose();
    expect(vector.poses).toHaveLength(vector.frames);
    vector.poses.forEach(({ root, rotations }, frame) => {
      block.poseAt(frame, pose);
      root.forEach((value, i) =>
        expect(Math.abs(pose.root[i] - value)).toBeLessThan(1e-9 * Math.max(1, Math.abs(value))),
      );
      rotations.forEach((value, i) => expect(Math.abs(pose.rotations[i] - value)).toBeLessThan(1e-9));
    });
  });

  test.each(golden.invalid)("refuses: $why", ({ frames, block }) => {
    expect(() => track.decode(frames, decodeBase64(block))).toThrow(DamagedBlock);
  });
});

test("block of another number of frames than its message is refused", () => {
  // its header gives the number, since it was coded for messages of four frames
  const [{ block }] = golden.valid.slice(-1);
  expect(() => track.decode(3, decodeBase64(block))).toThrow("A live block has 2 frames, its message 3.");
});

test("arbitrary bytes decode to finite poses or are refused", () => {
  const outcome = new HostileInputCounts(DamagedBlock);
  const pose = restPose();
  const valid = golden.valid.map(({ block }) => decodeBase64(block));
  const change = fc.tuple(fc.nat(), fc.nat(255));
  const damaged = fc
    .tuple(fc.constantFrom(...valid), fc.array(change, { minLength: 1, maxLength: 4 }))
    .map(([block, changes]) => {
      const bytes = block.slice();
      for (const [position, value] of changes) bytes[position % bytes.length] = value;
      return bytes;
    });
  fc.assert(
    fc.property(fc.integer({ min: 1, max: 16 }), fc.oneof(damaged, fc.uint8Array({ maxLength: 100 })), (frames, data) =>
      outcome.run(() => {
        const block = track.decode(frames, data);
        expect(block.frames).toBe(frames);
        for (let frame = 0; frame < frames; frame++) {
          block.poseAt(frame, pose);
          if (![...pose.root, ...pose.rotations].every(Number.isFinite)) throw new Error("a pose that is not finite");
        }
      }),
    ),
    { numRuns: 2000 },
  );
  outcome.print("live blocks");
});
