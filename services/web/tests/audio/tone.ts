/** Sound defined by a function, and a fake decoder whose packets are their numbers, in place of Opus. */
import type { DecoderFactory } from "../../src/audio/packet-decoder";
import { AudioTrack, PACKET_SAMPLES } from "../../src/codec/audio";
import { parseTiming } from "../../src/codec/timing";

/** Create a track of `seconds` of sound beside a motion of the same duration. */
export function createTrack(seconds: number, channels = 1, preSkip = 312): AudioTrack {
  const timing = parseTiming(
    { fps: 30, frames: Math.ceil(seconds * 30), block_frames: 30, first_frames: Math.min(15, Math.ceil(seconds * 30)) },
    "motion",
  );
  return new AudioTrack(timing, channels, preSkip, Math.floor(seconds * 48_000));
}

/** Return sample `at` of two tones, which differ per channel; full scale is one. */
export function toneSample(at: number, channel = 0): number {
  return (
    0.4 * Math.sin((2 * Math.PI * 441 * at) / 48_000 + channel) +
    0.2 * Math.sin((2 * Math.PI * (1003 + 200 * channel) * at) / 48_000)
  );
}

/** Return the samples of packet `number` of the tones. */
export function packetSamples(track: AudioTrack, number: number): Float32Array<ArrayBuffer>[] {
  return Array.from({ length: track.channels }, (_, channel) =>
    Float32Array.from({ length: PACKET_SAMPLES }, (_, at) => toneSample(track.firstSample(number) + at, channel)),
  );
}

/** Calls of decoders: "made", packet numbers, "ended". */
export type DecoderCalls = (number | "made" | "ended")[];

/**
 * Create a decoder of the tones; packet `broken` cannot be decoded. Without `atOnce`, results are emitted when
 * `deliver` is called.
 */
export function createToneDecoder(
  track: AudioTrack,
  calls: DecoderCalls = [],
  { broken = -1, atOnce = true } = {},
): { createDecoder: DecoderFactory; deliver: () => void } {
  const pending: (() => void)[] = [];
  const createDecoder: DecoderFactory = (emit) => {
    calls.push("made");
    return {
      decode(number) {
        calls.push(number);
        const out = () => emit(number, number === broken ? null : packetSamples(track, number));
        if (atOnce) out();
        else pending.push(out);
      },
      close: () => void calls.push("ended"),
    };
  };
  return { createDecoder, deliver: () => pending.splice(0).forEach((out) => out()) };
}
