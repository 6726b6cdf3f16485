/** Opus by libopus in WebAssembly, for browsers without a decoder of their own and for pages that are not served securely. */

import { OpusDecoder } from "opus-decoder";
import { PACKET_SAMPLES } from "../codec/audio";
import type { DecoderFactory } from "./packet-decoder";

export function createWasmDecoder(channels: number): DecoderFactory {
  return (emit) => {
    const decoder = new OpusDecoder({ channels, preSkip: 0 });
    let ended = false;
    let waiting: [number: number, packet: Uint8Array][] | null = [];
    const decode = (number: number, packet: Uint8Array) => {
      const { channelData, samplesDecoded } = decoder.decodeFrame(packet);
      emit(number, samplesDecoded === PACKET_SAMPLES ? channelData.map((plane) => plane.slice()) : null);
    };
    void decoder.ready.then(() => {
      for (const [number, packet] of waiting ?? []) decode(number, packet);
      waiting = null;
      if (ended) decoder.free();
    });
    return {
      decode(number, packet) {
        if (waiting) waiting.push([number, packet]);
        else decode(number, packet);
      },
      close() {
        ended = true;
        if (!waiting) decoder.free();
      },
    };
  };
}
