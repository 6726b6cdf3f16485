/** The sound of the packets about the play position, decoded as they are wanted (`proto/SPEC.md`, Audio block, Decoding). */

import { PACKET } from "../codec/audio";
import type { MakeDecoder, PacketDecoder } from "./packet-decoder";

/** Packets that are kept decoded: some eight seconds, 3 MB in stereo. */
const KEPT = 128;

/** So many packets before the first are decoded and not played, so that the decoder knows what went before. */
const BEFORE = 2;

export type Planes = readonly Float32Array<ArrayBuffer>[];

export class DecodedSound {
  /** By packet, the oldest first; null where one could not be decoded. */
  private readonly sounds = new Map<number, Planes | null>();
  /** Packets on their way, and through which decoder. */
  private readonly pending = new Map<number, PacketDecoder>();
  private decoder: PacketDecoder | null = null;
  /** The packet that would follow in the decoder. */
  private next = -1;

  /**
   * @param make makes a decoder
   * @param packet the bytes of a packet, null where they are not here
   */
  constructor(private readonly make: MakeDecoder, private readonly packet: (number: number) => Uint8Array | null) {}

  /** What packet `number` sounds like, a plane of `PACKET` samples for each channel; null where it is not decoded. */
  sound(number: number): Planes | null {
    return this.sounds.get(number) ?? null;
  }

  /** Decodes these packets, in the order in which they will be heard, as far as they are here. */
  want(numbers: Iterable<number>): void {
    for (const number of numbers) {
      const bytes = this.packet(number);
      if (!bytes || this.sounds.has(number) || this.pending.has(number)) continue;
      if (number !== this.next || !this.decoder) this.decoder = this.start(number);
      this.pending.set(number, this.decoder);
      this.next = number + 1;
      this.decoder.decode(number, bytes);
    }
  }

  /** Ends decoding. */
  close(): void {
    this.decoder?.end();
    this.decoder = null;
  }

  /** A decoder made anew, to go on with packet `first`. What the one before still decodes is kept. */
  private start(first: number): PacketDecoder {
    this.decoder?.end();
    const before: [number, Uint8Array][] = [];
    for (let number = Math.max(first - BEFORE, 0); number < first; number++) {
      const bytes = this.sounds.get(number) === null ? null : this.packet(number);
      if (bytes) before.push([number, bytes]);
    }
    const knows = before.length === Math.min(BEFORE, first);
    const decoder = this.make((number, planes) => {
      if (!planes) this.fail(decoder);
      else if (number < first) return;
      this.pending.delete(number);
      this.keep(number, number === first && !knows && planes ? planes.map(fadeIn) : planes);
    });
    if (knows) for (const [number, bytes] of before) decoder.decode(number, bytes);
    return decoder;
  }

  /** A decoder came upon what it cannot decode: it may be done for, and what else it was given is decoded by another. */
  private fail(decoder: PacketDecoder): void {
    for (const [number, by] of this.pending) if (by === decoder) this.pending.delete(number);
    if (decoder === this.decoder) this.next = -1;
  }

  private keep(number: number, planes: Planes | null): void {
    this.sounds.set(number, planes);
    for (const oldest of this.sounds.keys()) {
      if (this.sounds.size <= KEPT) break;
      this.sounds.delete(oldest);
    }
  }
}

function fadeIn(plane: Float32Array<ArrayBuffer>): Float32Array<ArrayBuffer> {
  return plane.map((sample, at) => (sample * at) / PACKET);
}
