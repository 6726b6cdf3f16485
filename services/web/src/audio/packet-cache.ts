/** The sound of the packets about the play position, decoded as they are wanted (`proto/SPEC.md`, Audio block, Decoding). */

import { PACKET_SAMPLES } from "../codec/audio";
import type { DecoderFactory, PacketDecoder } from "./packet-decoder";

/** Packets that are kept decoded: some eight seconds, 3 MB in stereo. */
const MAX_CACHED_PACKETS = 128;

/** So many packets before the first are decoded and not played, so that the decoder knows what went before. */
const WARM_UP_PACKETS = 2;

export type ChannelPlanes = readonly Float32Array<ArrayBuffer>[];

export class DecodedPacketCache {
  /** By packet, the oldest first; null where one could not be decoded. */
  private readonly packets = new Map<number, ChannelPlanes | null>();
  /** Packets on their way, and through which decoder. */
  private readonly pending = new Map<number, PacketDecoder>();
  private decoder: PacketDecoder | null = null;
  /** The packet that would follow in the decoder. */
  private next = -1;

  /**
   * @param createPacketDecoder makes a decoder
   * @param packet the bytes of a packet, null where they are not here
   */
  constructor(
    private readonly createPacketDecoder: DecoderFactory,
    private readonly packet: (number: number) => Uint8Array | null,
  ) {}

  /** What packet `number` sounds like, a plane of `PACKET` samples for each channel; null where it is not decoded. */
  get(number: number): ChannelPlanes | null {
    return this.packets.get(number) ?? null;
  }

  /** Decodes these packets, in the order in which they will be heard, as far as they are here. */
  decode(numbers: Iterable<number>): void {
    for (const number of numbers) {
      const bytes = this.packet(number);
      if (!bytes || this.packets.has(number) || this.pending.has(number)) continue;
      if (number !== this.next || !this.decoder) this.decoder = this.createDecoder(number);
      this.pending.set(number, this.decoder);
      this.next = number + 1;
      this.decoder.decode(number, bytes);
    }
  }

  /** Ends decoding. */
  close(): void {
    this.decoder?.close();
    this.decoder = null;
  }

  /** A decoder made anew, to go on with packet `first`. What the one before still decodes is kept. */
  private createDecoder(first: number): PacketDecoder {
    this.decoder?.close();
    const before: [number, Uint8Array][] = [];
    for (let number = Math.max(first - WARM_UP_PACKETS, 0); number < first; number++) {
      const bytes = this.packets.get(number) === null ? null : this.packet(number);
      if (bytes) before.push([number, bytes]);
    }
    const knows = before.length === Math.min(WARM_UP_PACKETS, first);
    const decoder = this.createPacketDecoder((number, planes) => {
      if (!planes) this.discardPending(decoder);
      else if (number < first) return;
      this.pending.delete(number);
      this.store(number, number === first && !knows && planes ? planes.map(fadeIn) : planes);
    });
    if (knows) for (const [number, bytes] of before) decoder.decode(number, bytes);
    return decoder;
  }

  /** A decoder came upon what it cannot decode: it may be done for, and what else it was given is decoded by another. */
  private discardPending(decoder: PacketDecoder): void {
    for (const [number, by] of this.pending) if (by === decoder) this.pending.delete(number);
    if (decoder === this.decoder) this.next = -1;
  }

  private store(number: number, planes: ChannelPlanes | null): void {
    this.packets.set(number, planes);
    for (const oldest of this.packets.keys()) {
      if (this.packets.size <= MAX_CACHED_PACKETS) break;
      this.packets.delete(oldest);
    }
  }
}

function fadeIn(plane: Float32Array<ArrayBuffer>): Float32Array<ArrayBuffer> {
  return plane.map((sample, at) => (sample * at) / PACKET_SAMPLES);
}
