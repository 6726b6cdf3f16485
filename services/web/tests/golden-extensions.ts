/** Extensions of `proto/vectors/extension.json`. */
import { ExtensionTrack } from "../src/codec/extension-track";
import { decodeBase64, loadVectors } from "./golden-vectors";

type Description = Record<string, unknown> & { joints?: unknown };

export interface ExtensionVectors {
  tracks: (Description & { names: string[] })[];
  valid: {
    track: number;
    block: string;
    frames: number;
    step: number;
    q: number[];
    values: { instant: number; numbers: number[] }[];
  }[];
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
