/** What turns Opus packets into sound, whichever it is in this browser. */

/**
 * What packet `number` sounds like, `PACKET` samples for each channel; null where it cannot be decoded. After that a decoder may
 * be done for, and nothing more come out of it.
 */
export type PacketHandler = (number: number, channels: Float32Array<ArrayBuffer>[] | null) => void;

export interface PacketDecoder {
  /** Decodes a packet, which follows the one before. */
  decode(number: number, packet: Uint8Array): void;
  /** No more will follow; what was given comes out still. */
  close(): void;
}

/** Makes a decoder anew, that knows of no packet before. */
export type DecoderFactory = (emit: PacketHandler) => PacketDecoder;

/** The decoder of this browser for `channels` (1 or 2): its own if it can Opus, else one that is fetched. */
export async function findDecoder(channels: number): Promise<DecoderFactory> {
  const { findWebCodecsDecoder: webCodecsDecoder } = await import("./webcodecs-decoder");
  return (await webCodecsDecoder(channels)) ?? (await import("./wasm-decoder")).createWasmDecoder(channels);
}
