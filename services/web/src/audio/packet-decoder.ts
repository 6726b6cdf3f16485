/** Interface of the Opus decoders. */

/**
 * Receives the samples of packet `number`, `PACKET_SAMPLES` per channel; null if it cannot be decoded. After an error a
 * decoder may be unusable and emit nothing more.
 */
export type PacketHandler = (number: number, channels: Float32Array<ArrayBuffer>[] | null) => void;

export interface PacketDecoder {
  /** Decode the packet that follows the last one. */
  decode(number: number, packet: Uint8Array): void;
  /** End the input; packets already passed are still emitted. */
  close(): void;
}

/** Creates a decoder without state. */
export type DecoderFactory = (emit: PacketHandler) => PacketDecoder;
