/** Props of a motion sampled at every frame. */

import type { PropState } from "../codec/extension/props";
import type { PropBlockStore } from "../playout/prop-store";
import { limbNumber, limbWithinPerformer, performerOfLimb } from "../wire/limbs";
import type { SampledProp } from "./glb-props";
import type { SampledMotion } from "./sampled-motion";

/**
 * Sample the props at the frames of a motion. Limbs are those of the exported `performers`, which have
 * their numbers on the stage: a prop in a hand of another is not shown. All blocks must be loaded.
 */
export function sampleProps(
  stores: readonly PropBlockStore[],
  { frames, fps }: Pick<SampledMotion, "frames" | "fps">,
  performers: readonly number[],
): SampledProp[] {
  return stores.flatMap((store) => {
    const props = store.track.kinds.map((kind) => ({ kind, states: new Array<PropState | null>(frames).fill(null) }));
    for (let frame = 0; frame < frames; frame++)
      for (const { prop, limb, place } of store.propsAt((frame * 1e6) / fps, 0)) {
        const index = limb === null ? 0 : performers.indexOf(performerOfLimb(limb));
        if (index < 0) continue;
        const ownLimb = limb === null ? null : limbNumber(index, limbWithinPerformer(limb));
        props[prop].states[frame] = { limb: ownLimb, place };
      }
    return props;
  });
}
