import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import { DamagedBlock } from "../../../src/codec/errors";
import { decodeExtensionBlock, ExtensionTrack } from "../../../src/codec/extension/track";
import { expectGoldenBlock, extensionVectors, goldenExtensionTrack } from "../../golden-extensions";
import { decodeBase64 } from "../../golden-vectors";

const golden = extensionVectors();
const tracks = golden.tracks.map(goldenExtensionTrack);

describe("golden blocks", () => {
  test.each(golden.valid)("block of track $track, $frames frames at step $step", (vector) => {
    expectGoldenBlock(tracks[vector.track], vector);
  });

  test.each(golden.invalid)("$why is refused", ({ block }) => {
    expect(() => decodeExtensionBlock(tracks[0], decodeBase64(block))).toThrow(DamagedBlock);
  });
});

test("names of the joints follow their number", () => {
  const names = tracks.map(({ content }) => (content.part === "body" ? content.body.names : null));
  expect(names).toEqual(golden.tracks.map(({ names }) => names));
});

test.each(golden.invalid_tracks)("description with $why is refused", ({ track }) => {
  expect(() => goldenExtensionTrack(track)).toThrow(DamagedBlock);
});

test.each([true, false, 0.5, "0", -1])("description of performer %j is refused", (performer) => {
  const joints = decodeBase64(golden.tracks[0].joints as string);
  expect(() => ExtensionTrack.fromDescription({ ...golden.tracks[0], joints, performer })).toThrow(/index/);
});

test("description without timing is refused", () => {
  const joints = decodeBase64(golden.tracks[0].joints as string);
  expect(() => ExtensionTrack.fromDescription({ ...golden.tracks[0], joints, frames: 0 })).toThrow(DamagedBlock);
});

test("damaged block gives finite values or is refused", () => {
  fc.assert(
    fc.property(fc.uint8Array({ maxLength: 300 }), (data) => {
      try {
        const block = decodeExtensionBlock(tracks[0], data);
        const out = new Float64Array(tracks[0].layout.count * 3);
        block.valuesAt(block.frames - 0.5, out);
        expect(out.every(Number.isFinite)).toBe(true);
      } catch (error) {
        expect(error).toBeInstanceOf(DamagedBlock);
      }
    }),
  );
});
