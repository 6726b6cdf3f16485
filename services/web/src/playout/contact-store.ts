/** Blocks of foot contacts that a viewer holds (`proto/codec.md`, 2.20). */

import { type ContactBlock, type ContactTrack, decodeContactBlock } from "../codec/extension/contact";
import { FrameBlockStore } from "./frame-store";

/** Decoded blocks of the contacts of one performer. */
export class ContactBlockStore extends FrameBlockStore<ContactTrack, ContactBlock> {
  /**
   * Return the feet that are planted at motion time `position` (microseconds), bit 0 for the left one; 0 if the block
   * is missing. A frame lasts until the next one.
   */
  plantedAt(position: number): number {
    const found = this.findFrame(position);
    return found ? found.block.planted[found.frame] : 0;
  }

  protected override decode(data: Uint8Array, index: number): ContactBlock {
    return decodeContactBlock(data, this.track.framesIn(index));
  }
}
