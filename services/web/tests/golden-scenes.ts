/** The golden camera of `proto/vectors/scene.json`: 78 frames at 30 fps in three blocks, as long as the first golden motion. */

import { decodeBase64, loadVectors } from "./golden-vectors";

interface Scenes {
  tracks: Record<string, unknown>[];
  valid: { track: number; block: string; values: { instant: number; numbers: number[] }[] }[];
}

const golden = loadVectors<Scenes>("scene");

/** The Description's map of a golden camera or light. */
export function goldenScene(which = 0): { type: string } & Record<string, unknown> {
  return golden.tracks[which] as { type: string } & Record<string, unknown>;
}

/** The camera's three blocks at its lower and at its higher rate. */
export const goldenCameraBlocks = [0, 3].map((first) =>
  golden.valid.slice(first, first + 3).map((vector) => decodeBase64(vector.block)),
);

/** The numbers of block `index` of the camera at its higher rate: of its first frame, and of its last. */
export function goldenCameraNumbers(index: number): [first: number[], last: number[]] {
  const { values } = golden.valid[3 + index];
  return [values[0].numbers, values[2].numbers];
}
