/** Fingers and faces of `proto/vectors/hands_face.json`. */
import { ExtensionTrack } from "../src/codec/extension/track";
import type { ExtensionBlockVector } from "./golden-extensions";
import { decodeBase64, loadVectors } from "./golden-vectors";

type Description = Record<string, unknown> & { joints?: unknown; axes?: unknown };

export interface HandsFaceVectors {
  expressions: string[];
  tracks: (Description & { names: string[] })[];
  valid: ExtensionBlockVector[];
  hands: {
    track: number;
    wrist_positions: number[];
    wrist_orientations: number[];
    values: number[];
    positions: number[];
    orientations: number[];
  }[];
  faces: { track: number; values: number[]; weights: number[] }[];
  invalid: { why: string; block: string }[];
  invalid_tracks: { why: string; track: Description }[];
}

/** Return the vectors. */
export function handsFaceVectors(): HandsFaceVectors {
  return loadVectors<HandsFaceVectors>("hands_face");
}

/** Return a description as a stream has it. */
export function goldenHandsFaceDescription(description: Description): Record<string, unknown> & { type: string } {
  const binary = (["joints", "axes"] as const).filter((key) => key in description);
  return {
    ...description,
    type: "extension",
    ...Object.fromEntries(binary.map((key) => [key, decodeBase64(description[key] as string)])),
  };
}

/** Return the track of a golden description. */
export function goldenHandsFaceTrack(description: Description): ExtensionTrack {
  return ExtensionTrack.fromDescription(goldenHandsFaceDescription(description));
}
