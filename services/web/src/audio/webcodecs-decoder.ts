/** Opus by the browser's own decoder (W3C WebCodecs, and its registration of Opus). */

import { SAMPLE_RATE } from "../codec/audio";
import type { DecoderFactory } from "./packet-decoder";

/** Microseconds of a packet. */
const PACKET_US = 60_000;

/** What makes decoders for `channels` (1 or 2), null where this browser cannot. */
export async function findWebCodecsDecoder(channels: number): Promise<DecoderFactory | null> {
  if (typeof AudioDecoder === "undefined") return null;
  // without the head of an Ogg file, so nothing is cut off at the beginning
  const config: AudioDecoderConfig = { codec: "opus", sampleRate: SAMPLE_RATE, numberOfChannels: channels };
  const able = await AudioDecoder.isConfigSupported(config).catch(() => null);
  if (!able?.supported) return null;
  return (emit) => {
    const waiting = new Set<number>();
    const decoder = new AudioDecoder({
      output(data) {
        const number = Math.round(data.timestamp / PACKET_US);
        const planes = Array.from({ length: channels }, (_, channel) => {
          const plane = new Float32Array(data.numberOfFrames);
          data.copyTo(plane, { planeIndex: Math.min(channel, data.numberOfChannels - 1), format: "f32-planar" });
          return plane;
        });
        data.close();
        waiting.delete(number);
        emit(number, planes);
      },
      // it is closed by that: nothing more comes out
      error(error) {
        console.warn(`sound could not be decoded: ${error.message}`);
        const [first] = waiting;
        if (first !== undefined) emit(first, null);
      },
    });
    decoder.configure(config);
    return {
      decode(number, packet) {
        if (decoder.state === "closed") {
          emit(number, null);
          return;
        }
        waiting.add(number);
        // Opus has no packets that need another: where decoding starts is for the caller to say
        decoder.decode(
          new EncodedAudioChunk({ type: "key", timestamp: number * PACKET_US, duration: PACKET_US, data: packet }),
        );
      },
      close() {
        if (decoder.state !== "closed")
          void decoder.flush().then(
            () => decoder.close(),
            () => undefined,
          );
      },
    };
  };
}
