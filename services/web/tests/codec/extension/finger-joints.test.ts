import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import { DamagedBlock } from "../../../src/codec/errors";
import { fingerLayout, inverseFingerWeights, unpackFingers } from "../../../src/codec/extension/finger-joints";
import { decodeExtensionBlock } from "../../../src/codec/extension/track";
import { HANIM_NAMES } from "../../../src/motion/hands";
import { expectGoldenBlock } from "../../golden-extensions";
import { goldenHandsFaceTrack, handsFaceVectors } from "../../golden-hands-face";
import { decodeBase64 } from "../../golden-vectors";

const golden = handsFaceVectors();
const tracks = golden.tracks.map(goldenHandsFaceTrack);

describe("golden blocks of fingers and faces", () => {
  test.each(golden.valid)("block of track $track, $frames frames at step $step", (vector) => {
    expectGoldenBlock(tracks[vector.track], vector);
  });

  test.each(golden.invalid)("$why is refused", ({ block }) => {
    expect(() => decodeExtensionBlock(tracks[0], decodeBase64(block))).toThrow(DamagedBlock);
  });

  test.each(golden.invalid_tracks)("description with $why is refused", ({ track }) => {
    expect(() => goldenHandsFaceTrack(track)).toThrow(DamagedBlock);
  });
});

test("joints have the names of their chains", () => {
  tracks.slice(0, 2).forEach(({ content }, track) => {
    const counts = content.part === "fingers" ? content.hands.counts : [];
    expect(counts.flatMap((count, chain) => HANIM_NAMES[chain].slice(0, count))).toEqual(golden.tracks[track].names);
  });
});

test("a damaged description is refused or finite", () => {
  fc.assert(
    fc.property(fc.uint8Array({ maxLength: 90 }), (data) => {
      try {
        const [hands, offsets] = unpackFingers(data);
        expect(hands.lengths.every(Number.isFinite)).toBe(true);
        expect(inverseFingerWeights(hands).every(Number.isFinite)).toBe(true);
        expect(fingerLayout(hands, offsets).count).toBe(offsets.length / 3);
      } catch (error) {
        expect(error).toBeInstanceOf(DamagedBlock);
      }
    }),
  );
});
