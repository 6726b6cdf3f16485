/** Live blocks and messages of `proto/vectors/live.json`. */

import { MotionTrack } from "../src/codec/motion-track";
import { goldenDescription } from "./golden-motion";
import { decodeBase64, loadVectors } from "./golden-vectors";

interface GoldenPose {
  root: number[];
  rotations: number[];
}

export interface LiveVectors {
  /** Skeleton description of the blocks. */
  dancer: string;
  valid: { frames: number; block: string; step: number; heading: number; q: number[]; poses: GoldenPose[] }[];
  invalid: { why: string; frames: number; block: string }[];
  show: {
    description: string;
    /** In the order of arrival. */
    messages: string[];
    poses: { clock: number; performers: (GoldenPose | null)[] }[];
  };
}

/** Returns a track of the performer of the live blocks. */
export function goldenLiveTrack(): MotionTrack {
  return MotionTrack.fromDescription(goldenLiveDescription());
}

/** Returns it as the map of a Description, with the timing of the first golden track. */
export function goldenLiveDescription(): ReturnType<typeof goldenDescription> {
  return { ...goldenDescription(), dancer: decodeBase64(loadVectors<LiveVectors>("live").dancer) };
}
