/** Blocks of foot contacts that a viewer holds (`proto/codec.md`, 2.20). */

import { type ContactBlock, type ContactTrack, decodeContactBlock } from "../codec/extension/contact";
import { TrackBlockStore } from "./block-store";

/** Decoded blocks of the contacts of one performer. */
export class ContactBlockStore extends TrackBlockStore<ContactTrack, ContactBlock> {
  /**
   * Return the feet that are planted at motion time `position` (microseconds), bit 0 for the left one; 0 if the block
   * is missing. A frame lasts until the next one.
   */
  plantedAt(position: number): number {
    const { track } = this;
    const location = this.findBlock(position, false, track.durationUs);
    if (!location) return 0;
    const { planted } = location.block;
    const frame = Math.floor(((position + 1) * track.fps) / 1e6) - track.firstFrame(track.blockAt(position));
    return planted[Math.min(Math.max(frame, 0), planted.length - 1)];
  }

  protected override decode(data: Uint8Array, index: number): ContactBlock {
    return decodeContactBlock(data, this.track.framesIn(index));
  }
}
