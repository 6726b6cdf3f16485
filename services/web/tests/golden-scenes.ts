/** Camera of `proto/vectors/scene.json`: 78 frames at 30 fps in three blocks, the timing of the first golden motion. */

import { decodeBase64, loadVectors } from "./golden-vectors";

interface Scenes {
  tracks: Record<string, unknown>[];
  valid: { track: number; block: string; values: { instant: number; numbers: number[] }[] }[];
}

const golden = loadVectors<Scenes>("scene");

/** Returns a golden camera or light as the map of a Description. */
export function goldenScene(which = 0): { type: string } & Record<string, unknown> {
  return golden.tracks[which] as { type: string } & Record<string, unknown>;
}

/** The camera's three blocks at its lower and its higher level. */
export const goldenCameraBlocks = [0, 3].map((first) =>
  golden.valid.slice(first, first + 3).map((vector) => decodeBase64(vector.block)),
);

/** Returns the values at the first and last frame of block `index` of the camera at its higher level. */
export function goldenCameraNumbers(index: number): [first: number[], last: number[]] {
  const { values } = golden.valid[3 + index];
  return [values[0].numbers, values[2].numbers];
}
