/** Extensions of `proto/vectors/extension.json`. */
import { expect } from "vitest";
import { decodeCoefficients } from "../src/codec/coefficients";
import { decodeExtensionBlock, ExtensionTrack } from "../src/codec/extension/track";
import { loadShippedPrior } from "../src/codec/prior";
import type { BodyExtension } from "../src/motion/extension";
import { decodeBase64, loadVectors } from "./golden-vectors";

type Description = Record<string, unknown> & { joints?: unknown };

/** A valid block with its header, coefficients and values. */
export interface ExtensionBlockVector {
  track: number;
  block: string;
  frames: number;
  step: number;
  q: number[];
  values: { instant: number; numbers: number[] }[];
}

export interface ExtensionVectors {
  tracks: (Description & { names: string[] })[];
  valid: ExtensionBlockVector[];
  poses: {
    track: number;
    offsets: number[];
    root: number[];
    rotations: number[];
    values: number[];
    positions: number[];
    orientations: number[];
    extra_positions: number[];
    extra_orientations: number[];
  }[];
  invalid: { why: string; block: string }[];
  invalid_tracks: { why: string; track: Description }[];
}

/** Return the vectors. */
export function extensionVectors(): ExtensionVectors {
  return loadVectors<ExtensionVectors>("extension");
}

/** Return a description as a stream has it. */
export function goldenDescription(description: Description): Record<string, unknown> & { type: string } {
  return { ...description, type: "extension", joints: decodeBase64(description.joints as string) };
}

/** Return the track of a golden description. */
export function goldenExtensionTrack(description: Description): ExtensionTrack {
  return ExtensionTrack.fromDescription(goldenDescription(description));
}

/** Return the body that a golden description adds. */
export function goldenBody(description: Description): BodyExtension {
  const { content } = goldenExtensionTrack(description);
  if (content.part !== "body") throw new Error(`The extension is of the ${content.part}.`);
  return content.body;
}

/** Expect that a block of `track` decodes as recorded. */
export function expectGoldenBlock(track: ExtensionTrack, vector: ExtensionBlockVector): void {
  const data = decodeBase64(vector.block);
  const { frames, step, q } = decodeCoefficients(loadShippedPrior(), data, track.blockFrames, track.fps, track.layout);
  expect([frames, step, [...q]]).toEqual([vector.frames, vector.step, vector.q]);
  const block = decodeExtensionBlock(track, data);
  const out = new Float64Array(track.layout.count * 3);
  for (const { instant, numbers } of vector.values) {
    block.valuesAt(instant, out);
    numbers.forEach((value, n) => expect(out[n]).toBeCloseTo(value, 11));
  }
}
