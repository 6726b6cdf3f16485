/** Audio blocks that a viewer holds (`proto/codec.md`, 2.15). */

import { type AudioPacket, type AudioTrack, unpackAudioBlock } from "../codec/audio";
import { DamagedBlock } from "../codec/errors";
import { TrackBlockStore } from "./block-store";

/** Block without its packets, which are stored by their number. */
interface AudioBlock {
  readonly frames: number;
}

/** Encoded packets of one audio track, each at the highest level received. */
export class AudioBlockStore extends TrackBlockStore<AudioTrack, AudioBlock> {
  /** Called with the packets of each stored block. */
  onPackets: (packets: readonly AudioPacket[]) => void = () => undefined;
  private readonly packets = new Map<number, Uint8Array>();

  /** Return the bytes of packet `number`, or null if they were not received. */
  packet(number: number): Uint8Array | null {
    return this.packets.get(number) ?? null;
  }

  protected override decode(data: Uint8Array, index: number): AudioBlock {
    const { track } = this;
    const packets = unpackAudioBlock(data);
    const last = packets.at(-1);
    if (last && last.number >= track.packetCount) {
      throw new DamagedBlock(
        `Block ${index} of the audio track holds packet ${last.number}, expected less than ${track.packetCount}.`,
      );
    }
    // copied, so that the message that carried the packets can be freed
    for (const packet of packets) this.packets.set(packet.number, packet.data.slice());
    this.onPackets(packets);
    return { frames: track.framesIn(index) };
  }
}
