/** The sound a viewer holds: packets of each block, of the best rate that came (`proto/SPEC.md`, Audio block). */

import { type AudioTrack, unpackAudioBlock } from "../codec/audio";
import { DamagedBlock } from "../codec/errors";
import { TrackBlockStore } from "./block-store";

/** What a block adds beside its packets, which are kept by their number. */
interface AudioBlock {
  readonly frames: number;
}

/** Packets of one audio track. Nothing is decoded here. */
export class AudioBlockStore extends TrackBlockStore<AudioTrack, AudioBlock> {
  private readonly packets = new Map<number, Uint8Array>();

  /** The bytes of packet `number`, null where they are not here. */
  packet(number: number): Uint8Array | null {
    return this.packets.get(number) ?? null;
  }

  protected override decode(data: Uint8Array, index: number): AudioBlock {
    const { track } = this;
    const packets = unpackAudioBlock(data);
    const last = packets.at(-1);
    if (last && last.number >= track.packetCount) {
      throw new DamagedBlock(`this audio has ${track.packetCount} packets, and none of number ${last.number}`);
    }
    // the message they came in is not kept
    for (const packet of packets) this.packets.set(packet.number, packet.data.slice());
    return { frames: track.framesIn(index) };
  }
}
