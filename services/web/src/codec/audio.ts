/**
 * Audio beside the motion: Opus packets in the motion's own blocks (`proto/SPEC.md`, Track `audio` and Audio block).
 *
 * Every packet holds `PACKET` samples, and packet p sounds from sample `PACKET` p - pre-skip on; sample 0 is the motion's first
 * frame. A packet lies in the block in which it starts. Nothing here decodes a packet.
 */

import { DamagedBlock } from "./errors";
import { Timing, type TrackDescription } from "./timing";

export const AUDIO_CODEC = "bunraku.audio/1";

/** Samples a second, of every track: Opus's own. */
export const SAMPLE_RATE = 48_000;

/** Samples of a packet: 60 ms. */
export const PACKET_SAMPLES = 2_880;

const MAX_BLOCK_BYTES = 65_536;
const MAX_PRE_SKIP_SAMPLES = 2 * PACKET_SAMPLES;
const MAX_LEVELS = 16;
// what four bytes number
const MAX_PACKETS = 2 ** 28;
// a track is shorter than 2^48 microseconds
const MAX_SAMPLES = 0.048 * 2 ** 48;

const SILK_FRAME_MS = [10, 20, 40, 60];
const CELT_FRAME_MS = [2.5, 5, 10, 20];

/** One Opus packet: its number in the track, and its bytes (a view of the block's). */
export interface AudioPacket {
  readonly number: number;
  readonly data: Uint8Array;
}

/** Constants of an audio track, as in the Description; its blocks are the motion's. */
export class AudioTrack extends Timing {
  /** Packets of each rate. */
  readonly packetCount: number;

  /**
   * @param motion frames and blocks of the motion
   * @param channels what to decode to, 1 or 2
   * @param preSkip samples that come out of a decoder before the first
   * @param samples sound in all, after which there is silence
   * @param kbps of each rate, from the lowest to the highest
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

  /** The sample with which packet `number` starts, at motion time 0 sample 0; of packet 0 it is negative. */
  firstSample(number: number): number {
    return PACKET_SAMPLES * number - this.preSkip;
  }

  /** Motion time at which packet `number` starts, microseconds, not always a whole number; of packet 0 it is negative. */
  packetStartUs(number: number): number {
    return (this.firstSample(number) * 1e6) / SAMPLE_RATE;
  }

  /** The packet whose sound is heard at motion time `positionUs`, microseconds; there may be none of that number any more. */
  packetAt(positionUs: number): number {
    return Math.floor(((positionUs * SAMPLE_RATE) / 1e6 + this.preSkip) / PACKET_SAMPLES);
  }

  /**
   * The track that a Description's map of type `audio` tells of, beside a motion of the timing `motion`.
   *
   * @throws DamagedBlock where it tells of none that can be played here
   */
  static fromDescription(description: TrackDescription, motion: Timing): AudioTrack {
    const { codec, channels, pre_skip: preSkip, samples, rates } = description;
    if (codec !== AUDIO_CODEC)
      throw new DamagedBlock(`audio is of codec ${String(codec)}; this client reads ${AUDIO_CODEC}`);
    const whole = (value: unknown, least: number, most: number) =>
      Number.isInteger(value) && Number(value) >= least && Number(value) <= most;
    if (!whole(channels, 1, 2)) throw new DamagedBlock("audio needs channels, 1 or 2");
    if (!whole(preSkip, 0, MAX_PRE_SKIP_SAMPLES))
      throw new DamagedBlock(`audio needs pre_skip, 0..${MAX_PRE_SKIP_SAMPLES} samples`);
    if (!whole(samples, 1, MAX_SAMPLES)) throw new DamagedBlock("audio needs samples, one at least");
    if (!Array.isArray(rates) || rates.length < 1 || rates.length > MAX_LEVELS) {
      throw new DamagedBlock(`audio needs rates, 1..${MAX_LEVELS} of them`);
    }
    const kbps = rates.map((rate: { kbps?: unknown } | null, nth) => {
      if (!Number.isFinite(rate?.kbps)) throw new DamagedBlock(`rate ${nth} of audio needs kbps, a number`);
      return Number(rate!.kbps);
    });
    return new AudioTrack(motion, Number(channels), Number(preSkip), Number(samples), kbps);
  }
}

/**
 * The packets of one block, in order; none where it has no bytes.
 *
 * @throws DamagedBlock on what cannot be a block
 */
export function unpackAudioBlock(data: Uint8Array): AudioPacket[] {
  if (data.length > MAX_BLOCK_BYTES)
    throw new DamagedBlock(`an audio block has at most ${MAX_BLOCK_BYTES} bytes, not ${data.length}`);
  const packets: AudioPacket[] = [];
  if (data.length === 0) return packets;
  let at = 0;
  const read = (): number => {
    for (let value = 0, shift = 0; shift < 28 && at < data.length; shift += 7) {
      const byte = data[at++];
      value |= (byte & 127) << shift;
      if (byte < 128) return value;
    }
    throw new DamagedBlock("a number in an audio block has 1 to 4 bytes");
  };
  let number = read();
  for (; at < data.length; number++) {
    const size = read();
    const packet = data.subarray(at, at + size);
    if (size === 0 || packet.length < size) {
      throw new DamagedBlock(`packet ${number} of an audio block has ${packet.length} of its ${size} bytes`);
    }
    const ms = packetDurationMs(packet);
    if (ms !== 60) throw new DamagedBlock(`packet ${number} of an audio block lasts ${ms} ms, not 60`);
    packets.push({ number, data: packet });
    at += size;
  }
  if (packets.length === 0 || number > MAX_PACKETS) {
    throw new DamagedBlock("an audio block has packets, numbered below 2^28, or no bytes at all");
  }
  return packets;
}

/** How long an Opus packet sounds, by its first bytes (RFC 6716, section 3.1). */
export function packetDurationMs(packet: Uint8Array): number {
  const kind = packet[0] >> 3;
  const code = packet[0] & 3;
  const frame = kind < 12 ? SILK_FRAME_MS[kind & 3] : kind < 16 ? SILK_FRAME_MS[kind & 1] : CELT_FRAME_MS[kind & 3];
  if (code < 3) return code === 0 ? frame : 2 * frame;
  return packet.length > 1 ? frame * (packet[1] & 63) : 0;
}
