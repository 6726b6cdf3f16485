/** Opus decoding by the browser (W3C WebCodecs and its Opus registration). */

import { SAMPLE_RATE } from "../codec/audio";
import type { DecoderFactory } from "./packet-decoder";

/** Duration of a packet, in microseconds. */
const PACKET_US = 60_000;

/** Return a factory of decoders for `channels` (1 or 2), or null if the browser has none. */
export async function findWebCodecsDecoder(channels: number): Promise<DecoderFactory | null> {
  if (typeof AudioDecoder === "undefined") return null;
  // Without the header of an Ogg file, so that no pre-skip is cut off.
  const config: AudioDecoderConfig = { codec: "opus", sampleRate: SAMPLE_RATE, numberOfChannels: channels };
  const support = await AudioDecoder.isConfigSupported(config).catch(() => null);
  if (!support?.supported) return null;
  return (emit) => {
    const pending = new Set<number>();
    const decoder = new AudioDecoder({
      output(data) {
        const number = Math.round(data.timestamp / PACKET_US);
        const planes = Array.from({ length: channels }, (_, channel) => {
          const plane = new Float32Array(data.numberOfFrames);
          data.copyTo(plane, { planeIndex: Math.min(channel, data.numberOfChannels - 1), format: "f32-planar" });
          return plane;
        });
        data.close();
        pending.delete(number);
        emit(number, planes);
      },
      // The error closes the decoder: it emits nothing more.
      error(error) {
        console.warn(`The browser could not decode the sound: ${error.message}`);
        const [first] = pending;
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
        pending.add(number);
        // Opus packets have no key frames: the caller chooses where decoding starts.
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
