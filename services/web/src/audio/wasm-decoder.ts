/** Opus decoding by libopus in WebAssembly, for browsers without a decoder and for pages in insecure contexts. */

import { OpusDecoder } from "opus-decoder";
import { PACKET_SAMPLES } from "../codec/audio";
import type { DecoderFactory } from "./packet-decoder";

export function createWasmDecoder(channels: number): DecoderFactory {
  return (emit) => {
    const decoder = new OpusDecoder({ channels, preSkip: 0 });
    let isClosed = false;
    let pending: [number: number, packet: Uint8Array][] | null = [];
    const decode = (number: number, packet: Uint8Array) => {
      const { channelData, samplesDecoded } = decoder.decodeFrame(packet);
      emit(number, samplesDecoded === PACKET_SAMPLES ? channelData.map((plane) => plane.slice()) : null);
    };
    void decoder.ready.then(() => {
      for (const [number, packet] of pending ?? []) decode(number, packet);
      pending = null;
      if (isClosed) decoder.free();
    });
    return {
      decode(number, packet) {
        if (pending) pending.push([number, packet]);
        else decode(number, packet);
      },
      close() {
        isClosed = true;
        if (!pending) decoder.free();
      },
    };
  };
}
