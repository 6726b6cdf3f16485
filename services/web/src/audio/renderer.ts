/** What a slot sounds like: the motion's sound at the positions that its frames have, and joints that do not click. Pure. */

import { type AudioTrack, PACKET_SAMPLES, SAMPLE_RATE } from "../codec/audio";
import type { TimelineSpan } from "../playout/timeline-span";
import type { ChannelPlanes } from "./packet-cache";
import { HALF_TAPS, resample } from "./resample";
import { SLOT_FRAMES, SLOT_US, type Slot } from "./schedule";

/** Frames in which a jump is made good: 8 ms. */
const CROSSFADE_FRAMES = 384;

/** A sound that goes on is where it was expected to within so many samples: clock times have no finer steps. */
const MAX_CONTINUOUS_OFFSET = 2;

/** What nobody hears, full scale being one: -80 dB. */
const SILENCE_LEVEL = 1e-4;

/** Where the sound stands between two slots. */
export interface SlotBoundary {
  /** The sample that would follow; null where none sounded. */
  readonly nextSample: number | null;
  /** What was put out last, of each channel. */
  readonly lastSamples: readonly number[];
  /** Of a jump still being made good: how large it was, of each channel, and how long ago, in frames. */
  readonly jump: readonly number[];
  readonly framesSinceJump: number;
}

export interface RenderedSlot {
  /** `SLOT` frames of each channel. */
  readonly planes: ChannelPlanes;
  /** Whether nothing in it is heard. */
  readonly isSilent: boolean;
  readonly boundary: SlotBoundary;
}

/** Frames `first`..`end` of a slot that sound on from sample `place`, or, where that is null, are silent. */
interface SlotSegment {
  readonly first: number;
  readonly end: number;
  readonly startSample: number | null;
}

/** Before anything sounds. */
export function silentBoundary(channels: number): SlotBoundary {
  const zeros = new Array<number>(channels).fill(0);
  return { nextSample: null, lastSamples: zeros, jump: zeros, framesSinceJump: CROSSFADE_FRAMES };
}

/** The packets that spans of motion need, in the order in which they are heard; one may be told twice. */
export function requiredPackets(track: AudioTrack, spans: readonly TimelineSpan[]): number[] {
  const numbers: number[] = [];
  for (const { start: from, end: to, position, isMoving: moving } of spans) {
    if (!moving) continue;
    const around = (HALF_TAPS * 1e6) / SAMPLE_RATE;
    const first = Math.max(track.packetAt(position - around), 0);
    const last = Math.min(track.packetAt(position + to - from + around), track.packetCount - 1);
    for (let number = first; number <= last; number++) numbers.push(number);
  }
  return numbers;
}

/**
 * The sound of `slot`, whose stage times are the `spans`, after one that ended in `before`. Where a packet that is needed is not
 * decoded (`sound` gives null) it is silent.
 */
export function renderSlot(
  track: AudioTrack,
  sound: (number: number) => ChannelPlanes | null,
  slot: Slot,
  spans: readonly TimelineSpan[],
  boundary: SlotBoundary,
): RenderedSlot {
  const planes = Array.from({ length: track.channels }, () => new Float32Array(SLOT_FRAMES));
  let { nextSample: place, lastSamples: last, jump, framesSinceJump: since } = boundary;
  for (const piece of spans.flatMap((span) => segmentsOf(track, sound, slot, span))) {
    const { first, end } = piece;
    if (first >= end) continue;
    const goesOn =
      piece.startSample === null
        ? place === null
        : place !== null && Math.abs(piece.startSample - place) < MAX_CONTINUOUS_OFFSET;
    const from = goesOn ? place : piece.startSample;
    if (from !== null) fillFrames(track, sound, from, slot.speed, planes, first, end);
    if (!goesOn) {
      jump = planes.map((plane, channel) => last[channel] - plane[first]);
      since = 0;
    }
    for (let frame = first; frame < end && since < CROSSFADE_FRAMES; frame++, since++) {
      const share = 0.5 + 0.5 * Math.cos((Math.PI * since) / CROSSFADE_FRAMES);
      planes.forEach((plane, channel) => (plane[frame] += share * jump[channel]));
    }
    last = planes.map((plane) => plane[end - 1]);
    place = from === null ? null : from + (end - first) * slot.speed;
  }
  const silent = planes.every((plane) => plane.every((sample) => Math.abs(sample) < SILENCE_LEVEL));
  return { planes, isSilent: silent, boundary: { nextSample: place, lastSamples: last, jump, framesSinceJump: since } };
}

/** A span of a slot as pieces that sound or do not. */
function segmentsOf(
  track: AudioTrack,
  sound: (number: number) => ChannelPlanes | null,
  slot: Slot,
  span: TimelineSpan,
): SlotSegment[] {
  const frameOf = (stage: number) =>
    Math.min(Math.max(Math.round(((stage - slot.stageTime) / (slot.speed * SLOT_US)) * SLOT_FRAMES), 0), SLOT_FRAMES);
  const [first, end] = [frameOf(span.start), frameOf(span.end)];
  if (!span.isMoving) return [{ first, end, startSample: null }];
  const begin = (span.position * SAMPLE_RATE) / 1e6;
  const pieces: SlotSegment[] = [];
  for (let frame = first; frame < end; ) {
    const place = begin + (frame - first) * slot.speed;
    const number = Math.floor((place + track.preSkip) / PACKET_SAMPLES);
    const over = place >= track.samples;
    const here = !over && number >= 0 && sound(number) !== null;
    const border = over ? Infinity : Math.min(track.firstSample(number + 1), track.samples);
    const until = Math.min(Math.max(first + Math.ceil((border - begin) / slot.speed), frame + 1), end);
    const before = pieces.at(-1);
    if (before && (before.startSample !== null) === here) pieces[pieces.length - 1] = { ...before, end: until };
    else pieces.push({ first: frame, end: until, startSample: here ? place : null });
    frame = until;
  }
  return pieces;
}

/** Fills frames `first`..`end` with the sound from sample `place` on. */
function fillFrames(
  track: AudioTrack,
  sound: (number: number) => ChannelPlanes | null,
  place: number,
  speed: number,
  planes: ChannelPlanes,
  first: number,
  end: number,
): void {
  const whole = Math.floor(place);
  const from = whole - (HALF_TAPS - 1);
  const size = Math.ceil((end - first) * speed) + 2 * HALF_TAPS + 2;
  planes.forEach((plane, channel) => {
    const samples = new Float32Array(size);
    for (let at = 0; at < size; ) {
      const within = from + at + track.preSkip;
      const number = Math.floor(within / PACKET_SAMPLES);
      const offset = within - number * PACKET_SAMPLES;
      const count = Math.min(PACKET_SAMPLES - offset, size - at);
      const source = number < 0 ? null : sound(number);
      if (source) samples.set(source[channel].subarray(offset, offset + count), at);
      at += count;
    }
    resample(samples, place - whole, speed, plane, first, end);
  });
}
