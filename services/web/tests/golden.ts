/** The golden blocks of `proto/vectors/blocks.json` and their track. */

import { MotionTrack } from "../src/codec/track";
import { bytes, vectors } from "./vectors";

export interface BlockVectors {
  track: { fps: number; frames: number; block_frames: number; figure: string; reference: string; levers: number[] };
  valid: {
    block: string;
    frames: number;
    step: number;
    q: number[];
    poses: { instant: number; root: number[]; rotations: number[] }[];
  }[];
  invalid: { why: string; block: string }[];
}

/** The golden track as a Description's map has it. */
export function goldenDescription(): { type: string } & Record<string, unknown> {
  const { track } = vectors<BlockVectors>("blocks");
  return {
    ...track, type: "motion", codec: "bunraku.motion/1", channels: 19, figure: bytes(track.figure),
    reference: bytes(track.reference), rates: [{ kbps: 1.5, mean: 5, max: 20 }, { kbps: 5, mean: 1, max: 4 }],
  };
}

/** The track of the golden blocks. */
export function goldenTrack(): MotionTrack {
  return MotionTrack.fromDescription(goldenDescription());
}
