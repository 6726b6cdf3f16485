/** Selection of the Opus decoder for this browser. */
import type { DecoderFactory } from "./packet-decoder";

/** Return the browser's Opus decoder for `channels` (1 or 2) or else the WebAssembly one, loaded on demand. */
export async function findDecoder(channels: number): Promise<DecoderFactory> {
  const { findWebCodecsDecoder } = await import("./webcodecs-decoder");
  return (await findWebCodecsDecoder(channels)) ?? (await import("./wasm-decoder")).createWasmDecoder(channels);
}
