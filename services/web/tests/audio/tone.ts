/** A sound that is told by a function, and a decoder to whom packets are its numbers: what stands for Opus where it is not what is tested. */
import type { DecoderFactory } from "../../src/audio/packet-decoder";
import { AudioTrack, PACKET_SAMPLES } from "../../src/codec/audio";
import { parseTiming } from "../../src/codec/timing";

/** A track of `seconds` of sound beside a motion of as many. */
export function createTrack(seconds: number, channels = 1, preSkip = 312): AudioTrack {
  const timing = parseTiming(
    { fps: 30, frames: Math.ceil(seconds * 30), block_frames: 30, first_frames: Math.min(15, Math.ceil(seconds * 30)) },
    "motion",
  );
  return new AudioTrack(timing, channels, preSkip, Math.floor(seconds * 48_000));
}

/** Two tones, another pair in each channel, at sample `at`; full scale is one. */
export function toneSample(at: number, channel = 0): number {
  return (
    0.4 * Math.sin((2 * Math.PI * 441 * at) / 48_000 + channel) +
    0.2 * Math.sin((2 * Math.PI * (1003 + 200 * channel) * at) / 48_000)
  );
}

/** What packet `number` of the tones sounds like. */
export function packetSamples(track: AudioTrack, number: number): Float32Array<ArrayBuffer>[] {
  return Array.from({ length: track.channels }, (_, channel) =>
    Float32Array.from({ length: PACKET_SAMPLES }, (_, at) => toneSample(track.firstSample(number) + at, channel)),
  );
}

/** What decoders were told: "made", packet numbers, "ended". */
export type DecoderCalls = (number | "made" | "ended")[];

/** A decoder of the tones; packet `broken` cannot be decoded. Without `at once` what it decoded comes when `deliver` is called. */
export function createToneDecoder(
  track: AudioTrack,
  deeds: DecoderCalls = [],
  { broken = -1, atOnce = true } = {},
): { make: DecoderFactory; deliver: () => void } {
  const waiting: (() => void)[] = [];
  const make: DecoderFactory = (emit) => {
    deeds.push("made");
    return {
      decode(number) {
        deeds.push(number);
        const out = () => emit(number, number === broken ? null : packetSamples(track, number));
        if (atOnce) out();
        else waiting.push(out);
      },
      close: () => void deeds.push("ended"),
    };
  };
  return { make, deliver: () => waiting.splice(0).forEach((out) => out()) };
}
