/** The lights among a motion's scenes, as they are at an instant. */

import type { SceneTrack } from "../codec/scene";

/** A light at an instant: its seven numbers (`proto/SPEC.md`, Scene block), and the intensity that counts as one. */
export interface LightState {
  readonly full: number;
  readonly numbers: ArrayLike<number>;
}

/** The lights of `scenes` in their order; `numbersOf` gives a scene's numbers, null where nothing is known of it yet. */
export function lightStates(
  scenes: readonly SceneTrack[],
  numbersOf: (scene: number) => ArrayLike<number> | null,
): LightState[] {
  return scenes.flatMap(({ kind, full }, scene) => {
    const numbers = kind === "light" ? numbersOf(scene) : null;
    return numbers ? [{ full, numbers }] : [];
  });
}
