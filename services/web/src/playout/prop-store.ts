/** Blocks of props that a viewer holds (`proto/codec.md`, 2.21). */

import { decodePropBlock, type PropBlock, type PropTrack } from "../codec/extension/props";
import { LIMBS } from "../motion/skeleton";
import type { PropPresence } from "../wire/messages";
import { FrameBlockStore } from "./frame-store";

/** Decoded blocks of the props of a motion. */
export class PropBlockStore extends FrameBlockStore<PropTrack, PropBlock> {
  /**
   * Return the props that are on the stage at motion time `position` (microseconds), numbered from `first` on; none if
   * the block is missing. A frame lasts until the next one.
   */
  propsAt(position: number, first: number): PropPresence[] {
    const { kinds, performer } = this.track;
    const found = this.findFrame(position);
    if (!found) return [];
    return kinds.flatMap((kind, index) => {
      const state = found.block.states[index][found.frame];
      if (!state) return [];
      const limb = state.limb === null ? null : state.limb + LIMBS.length * performer;
      return [{ prop: first + index, kind, limb, place: [...state.place] }];
    });
  }

  protected override decode(data: Uint8Array, index: number): PropBlock {
    return decodePropBlock(data, this.track.kinds.length, this.track.framesIn(index));
  }
}
