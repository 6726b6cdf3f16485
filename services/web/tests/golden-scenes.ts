/**
 * The golden camera of `proto/vectors/scene.json`: 78 frames at 30 fps in three blocks, as long as the first golden
 * motion.
 */

import { decodeBase64, loadVectors } from "./golden-vectors";

interface Scenes {
  tracks: Record<string, unknown>[];
  valid: { track: number; block: string; values: { instant: number; numbers: number[] }[] }[];
}

const golden = loadVectors<Scenes>("scene");

/** Return the Description's map of a golden camera or light. */
export function goldenScene(index = 0): { type: string } & Record<string, unknown> {
  return golden.tracks[index] as { type: string } & Record<string, unknown>;
}

/** The camera's three blocks at the lower and at the higher bitrate level. */
export const goldenCameraBlocks = [0, 3].map((first) =>
  golden.valid.slice(first, first + 3).map((vector) => decodeBase64(vector.block)),
);

/** Return the numbers of the first and the last frame of a camera block at the higher bitrate level. */
export function goldenCameraNumbers(index: number): [first: number[], last: number[]] {
  const { values } = golden.valid[3 + index];
  return [values[0].numbers, values[2].numbers];
}
