/** Cache of decoded packets around the play position, decoded on demand (`proto/codec.md`, 2.15, Decoding). */

import { PACKET_SAMPLES } from "../codec/audio";
import type { DecoderFactory, PacketDecoder } from "./packet-decoder";

/** Maximum number of decoded packets: about 8 s, 3 MB in stereo. */
const MAX_CACHED_PACKETS = 128;

/** Packets decoded before the first one and discarded, to bring the decoder into the right state. */
const WARM_UP_PACKETS = 2;

export type ChannelPlanes = readonly Float32Array<ArrayBuffer>[];

export class DecodedPacketCache {
  /** By packet number, the oldest first; null if a packet could not be decoded. */
  private readonly packets = new Map<number, ChannelPlanes | null>();
  /** Packets being decoded, and by which decoder. */
  private readonly pending = new Map<number, PacketDecoder>();
  private decoder: PacketDecoder | null = null;
  /** Number of the packet that would follow in the decoder. */
  private next = -1;

  /**
   * @param createPacketDecoder creates a decoder
   * @param packet returns the bytes of a packet, or null if they have not arrived
   */
  constructor(
    private readonly createPacketDecoder: DecoderFactory,
    private readonly packet: (number: number) => Uint8Array | null,
  ) {}

  /** Return the samples of a packet, `PACKET_SAMPLES` per channel; null if it is not decoded. */
  get(number: number): ChannelPlanes | null {
    return this.packets.get(number) ?? null;
  }

  /** Decode these packets, in the order in which they will be heard, as far as they have arrived. */
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

  close(): void {
    this.decoder?.close();
    this.decoder = null;
  }

  /** Create a decoder that continues with packet `first`. Packets that the last one is still decoding are kept. */
  private createDecoder(first: number): PacketDecoder {
    this.decoder?.close();
    const warmUp: [number, Uint8Array][] = [];
    for (let number = Math.max(first - WARM_UP_PACKETS, 0); number < first; number++) {
      const bytes = this.packets.get(number) === null ? null : this.packet(number);
      if (bytes) warmUp.push([number, bytes]);
    }
    const isWarmedUp = warmUp.length === Math.min(WARM_UP_PACKETS, first);
    const decoder = this.createPacketDecoder((number, planes) => {
      if (!planes) this.discardPending(decoder);
      else if (number < first) return;
      this.pending.delete(number);
      this.store(number, number === first && !isWarmedUp && planes ? planes.map(fadeIn) : planes);
    });
    if (isWarmedUp) for (const [number, bytes] of warmUp) decoder.decode(number, bytes);
    return decoder;
  }

  /** Handle a decoding error: the decoder may be unusable, so another one decodes its remaining packets. */
  private discardPending(decoder: PacketDecoder): void {
    for (const [number, owner] of this.pending) if (owner === decoder) this.pending.delete(number);
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
