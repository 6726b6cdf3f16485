/**
 * Audio track: Opus packets in the blocks of a motion (`proto/codec.md`, 2.15).
 *
 * A packet contains `PACKET_SAMPLES` samples; packet p starts at sample `PACKET_SAMPLES` * p - pre-skip, and sample 0
 * is the motion's first frame. A packet is in the block in which it starts. This module does not decode Opus.
 */

import { DamagedBlock } from "./errors";
import { Leb128Reader } from "./leb128";
import { Timing, type TrackDescription } from "./timing";

export const AUDIO_CODEC = "bunraku.audio/1";

/** Sample rate of all tracks, which is Opus's own. */
export const SAMPLE_RATE = 48_000;

/** Samples of a packet: 60 ms. */
export const PACKET_SAMPLES = 2_880;

const MAX_BLOCK_BYTES = 65_536;
const MAX_PRE_SKIP_SAMPLES = 2 * PACKET_SAMPLES;
const MAX_LEVELS = 16;
// packet numbers are LEB128 of at most four bytes
const MAX_PACKETS = 2 ** 28;
// a duration is less than 2^48 microseconds
const MAX_SAMPLES = 0.048 * 2 ** 48;

const SILK_FRAME_MS = [10, 20, 40, 60];
const CELT_FRAME_MS = [2.5, 5, 10, 20];

/** One Opus packet and its number in the track. Its bytes are a view of the block's. */
export interface AudioPacket {
  readonly number: number;
  readonly data: Uint8Array;
}

/** Constants of an audio track, whose blocks are those of the motion. */
export class AudioTrack extends Timing {
  /** Number of packets at each bitrate level. */
  readonly packetCount: number;

  /**
   * @param motion frames and blocks of the motion
   * @param channels channels of the decoder output, 1 or 2
   * @param preSkip first samples of the decoder output, which are not played
   * @param samples following samples, which are played
   * @param kbps bitrate of each level, lowest first
   */
  constructor(
    motion: Timing,
    readonly channels: number,
    readonly preSkip: number,
    readonly samples: number,
    readonly kbps: readonly number[] = [],
  ) {
    super(motion.fps, motion.frames, motion.blockFrames, motion.firstFrames);
    this.packetCount = Math.ceil((samples + preSkip) / PACKET_SAMPLES);
  }

  /** Returns the sample with which packet `number` starts, relative to motion time 0. Packet 0 is negative. */
  firstSample(number: number): number {
    return PACKET_SAMPLES * number - this.preSkip;
  }

  /**
   * Returns the motion time of the start of packet `number`, microseconds, not always an integer. Packet 0 is negative.
   */
  packetStartUs(number: number): number {
    return (this.firstSample(number) * 1e6) / SAMPLE_RATE;
  }

  /** Returns the number of the packet at a motion time in microseconds, possibly beyond the last packet. */
  packetAt(positionUs: number): number {
    return Math.floor(((positionUs * SAMPLE_RATE) / 1e6 + this.preSkip) / PACKET_SAMPLES);
  }

  /**
   * Returns the track of a Description's map of type `audio`, for a motion.
   *
   * @throws DamagedBlock if it is invalid or of another codec
   */
  static fromDescription(description: TrackDescription, motion: Timing): AudioTrack {
    const { codec, channels, pre_skip: preSkip, samples, rates } = description;
    if (codec !== AUDIO_CODEC)
      throw new DamagedBlock(`Unsupported audio codec ${String(codec)}, expected ${AUDIO_CODEC}.`);
    const isInRange = (value: unknown, min: number, max: number) =>
      Number.isInteger(value) && Number(value) >= min && Number(value) <= max;
    if (!isInRange(channels, 1, 2)) throw new DamagedBlock("Invalid audio track: channels must be 1 or 2.");
    if (!isInRange(preSkip, 0, MAX_PRE_SKIP_SAMPLES))
      throw new DamagedBlock(`Invalid audio track: pre_skip must be 0..${MAX_PRE_SKIP_SAMPLES}.`);
    if (!isInRange(samples, 1, MAX_SAMPLES))
      throw new DamagedBlock("Invalid audio track: samples must be at least 1 and less than 2^48 microseconds.");
    if (!Array.isArray(rates) || rates.length < 1 || rates.length > MAX_LEVELS) {
      throw new DamagedBlock(`Invalid audio track: rates must have 1..${MAX_LEVELS} entries.`);
    }
    const kbps = rates.map((rate: { kbps?: unknown } | null, level) => {
      if (!Number.isFinite(rate?.kbps))
        throw new DamagedBlock(`Invalid audio track: rate ${level} must have kbps, a number.`);
      return Number(rate!.kbps);
    });
    return new AudioTrack(motion, Number(channels), Number(preSkip), Number(samples), kbps);
  }
}

/**
 * Returns the packets of one block, in order.
 *
 * @throws DamagedBlock
 */
export function unpackAudioBlock(data: Uint8Array): AudioPacket[] {
  if (data.length > MAX_BLOCK_BYTES)
    throw new DamagedBlock(`Invalid audio block: ${data.length} bytes, at most ${MAX_BLOCK_BYTES} are allowed.`);
  const packets: AudioPacket[] = [];
  if (data.length === 0) return packets;
  const reader = new Leb128Reader(data);
  let number = reader.read();
  for (; reader.offset < data.length; number++) {
    const length = reader.read();
    const packet = data.subarray(reader.offset, reader.offset + length);
    if (length === 0 || packet.length < length) {
      throw new DamagedBlock(`Invalid audio block: packet ${number} has ${packet.length} of ${length} bytes.`);
    }
    const ms = packetDurationMs(packet);
    if (ms !== 60) throw new DamagedBlock(`Invalid audio block: packet ${number} lasts ${ms} ms, not 60.`);
    packets.push({ number, data: packet });
    reader.offset += length;
  }
  if (packets.length === 0 || number > MAX_PACKETS) {
    throw new DamagedBlock("Invalid audio block: expected packets with numbers below 2^28, or no bytes at all.");
  }
  return packets;
}

/** Returns the duration of an Opus packet from its first bytes (RFC 6716, section 3.1). */
export function packetDurationMs(packet: Uint8Array): number {
  const configuration = packet[0] >> 3;
  const code = packet[0] & 3;
  const frame =
    configuration < 12
      ? SILK_FRAME_MS[configuration & 3]
      : configuration < 16
        ? SILK_FRAME_MS[configuration & 1]
        : CELT_FRAME_MS[configuration & 3];
  if (code < 3) return code === 0 ? frame : 2 * frame;
  return packet.length > 1 ? frame * (packet[1] & 63) : 0;
}
