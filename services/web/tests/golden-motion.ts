/** Motion blocks of `proto/vectors/blocks.json` and their tracks. */

import { MotionTrack } from "../src/codec/motion-track";
import { decodeBase64, loadVectors } from "./golden-vectors";

export interface BlockVectors {
  /** The first track has blocks of 30, 30 and 18 frames; the first four valid blocks are 0 at two levels, 1 and 2. */
  tracks: {
    fps: number;
    frames: number;
    block_frames: number;
    first_frames: number;
    dancer: string;
    /** Decoded from `dancer`: offsets (54) and tips (54) in metres, reference rotations (72, root first). */
    offsets: number[];
    tips: number[];
    reference: number[];
    /** [channel 19][3][3] */
    weights: number[][][];
  }[];
  valid: {
    track: number;
    block: string;
    frames: number;
    step: number;
    heading: number;
    q: number[];
    poses: { instant: number; root: number[]; rotations: number[] }[];
  }[];
  /** Invalid blocks of the first track. */
  invalid: { why: string; block: string }[];
}

/** Returns a golden track as the map of a Description. */
export function goldenDescription(which = 0): { type: string } & Record<string, unknown> {
  const { fps, frames, block_frames, first_frames, dancer } = loadVectors<BlockVectors>("blocks").tracks[which];
  return {
    fps,
    frames,
    block_frames,
    first_frames,
    type: "motion",
    codec: "bunraku.motion/2",
    channels: 19,
    dancer: decodeBase64(dancer),
    rates: [
      { kbps: 1.5, mean: 5, max: 20 },
      { kbps: 5, mean: 1, max: 4 },
    ],
  };
}

/** Returns a track of the golden blocks. */
export function goldenTrack(which = 0): MotionTrack {
  return MotionTrack.fromDescription(goldenDescription(which));
}
