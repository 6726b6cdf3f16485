/** States of a motion's lights at one instant. */

import type { SceneTrack } from "../codec/scene";

/** Light at one instant: its seven values (`proto/codec.md`, 2.14), and the intensity that equals full scale. */
export interface LightState {
  readonly full: number;
  readonly numbers: ArrayLike<number>;
}

/** Return the lights among `scenes`, in order. `valuesOf` returns a scene's values, null before its first block. */
export function lightStates(
  scenes: readonly SceneTrack[],
  valuesOf: (scene: number) => ArrayLike<number> | null,
): LightState[] {
  return scenes.flatMap(({ kind, full }, scene) => {
    const numbers = kind === "light" ? valuesOf(scene) : null;
    return numbers ? [{ full, numbers }] : [];
  });
}
