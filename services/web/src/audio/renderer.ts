/**
 * Rendering of a slot: samples of the motion's sound at the positions of its frames, without clicks at discontinuities.
 * Pure.
 */

import { type AudioTrack, PACKET_SAMPLES, SAMPLE_RATE } from "../codec/audio";
import type { TimelineSpan } from "../playout/timeline-span";
import type { ChannelPlanes } from "./packet-cache";
import { HALF_TAPS, resample } from "./resample";
import { SLOT_FRAMES, SLOT_US, type Slot } from "./schedule";

/** Duration over which a discontinuity is faded out: 8 ms. */
const CROSSFADE_FRAMES = 384;

/** Position errors below this many samples count as continuous: clock times have no finer resolution. */
const MAX_CONTINUOUS_OFFSET = 2;

/** Level below which sound is inaudible, relative to full scale: -80 dB. */
const SILENCE_LEVEL = 1e-4;

/** State of the sound between two slots. */
export interface SlotBoundary {
  /** Position of the next sample; null after silence. */
  readonly nextSample: number | null;
  /** Last output sample of each channel. */
  readonly lastSamples: readonly number[];
  /** Discontinuity that is being faded out: its size per channel, and its age in frames. */
  readonly jump: readonly number[];
  readonly framesSinceJump: number;
}

export interface RenderedSlot {
  /** `SLOT_FRAMES` frames per channel. */
  readonly planes: ChannelPlanes;
  /** True if the slot is inaudible. */
  readonly isSilent: boolean;
  readonly boundary: SlotBoundary;
}

/** Frames `first`..`end` of a slot that play on from sample `startSample`, or are silent if it is null. */
interface SlotSegment {
  readonly first: number;
  readonly end: number;
  readonly startSample: number | null;
}

/** Return the state before any sound. */
export function silentBoundary(channels: number): SlotBoundary {
  const zeros = new Array<number>(channels).fill(0);
  return { nextSample: null, lastSamples: zeros, jump: zeros, framesSinceJump: CROSSFADE_FRAMES };
}

/** Return the packets that spans of the motion need, in the order in which they are heard, possibly repeated. */
export function requiredPackets(track: AudioTrack, spans: readonly TimelineSpan[]): number[] {
  const numbers: number[] = [];
  for (const { start: from, end: to, position, isMoving } of spans) {
    if (!isMoving) continue;
    const margin = (HALF_TAPS * 1e6) / SAMPLE_RATE;
    const first = Math.max(track.packetAt(position - margin), 0);
    const last = Math.min(track.packetAt(position + to - from + margin), track.packetCount - 1);
    for (let number = first; number <= last; number++) numbers.push(number);
  }
  return numbers;
}

/**
 * Render `slot`, whose stage times are `spans`, after one that ended in `boundary`. Where a packet is not decoded
 * (`sound` returns null) the slot is silent.
 */
export function renderSlot(
  track: AudioTrack,
  sound: (number: number) => ChannelPlanes | null,
  slot: Slot,
  spans: readonly TimelineSpan[],
  boundary: SlotBoundary,
): RenderedSlot {
  const planes = Array.from({ length: track.channels }, () => new Float32Array(SLOT_FRAMES));
  let { nextSample: position, lastSamples: last, jump, framesSinceJump } = boundary;
  for (const segment of spans.flatMap((span) => segmentsOf(track, sound, slot, span))) {
    const { first, end } = segment;
    if (first >= end) continue;
    const isContinuous =
      segment.startSample === null
        ? position === null
        : position !== null && Math.abs(segment.startSample - position) < MAX_CONTINUOUS_OFFSET;
    // A whole sample, so that at the sound's own speed nothing has to be resampled.
    const from = isContinuous ? position : segment.startSample && Math.round(segment.startSample);
    if (from !== null) fillFrames(track, sound, from, slot.speed, planes, first, end);
    if (!isContinuous) {
      jump = planes.map((plane, channel) => last[channel] - plane[first]);
      framesSinceJump = 0;
    }
    for (let frame = first; frame < end && framesSinceJump < CROSSFADE_FRAMES; frame++, framesSinceJump++) {
      const share = 0.5 + 0.5 * Math.cos((Math.PI * framesSinceJump) / CROSSFADE_FRAMES);
      planes.forEach((plane, channel) => (plane[frame] += share * jump[channel]));
    }
    last = planes.map((plane) => plane[end - 1]);
    position = from === null ? null : from + (end - first) * slot.speed;
  }
  return {
    planes,
    isSilent: planes.every(isInaudible),
    boundary: { nextSample: position, lastSamples: last, jump, framesSinceJump },
  };
}

/** Split a span of a slot into segments that are audible or silent. */
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
  const segments: SlotSegment[] = [];
  for (let frame = first; frame < end; ) {
    const position = begin + (frame - first) * slot.speed;
    const number = Math.floor((position + track.preSkip) / PACKET_SAMPLES);
    const isPastEnd = position >= track.samples;
    const isAvailable = !isPastEnd && number >= 0 && sound(number) !== null;
    const packetEnd = isPastEnd ? Infinity : Math.min(track.firstSample(number + 1), track.samples);
    const segmentEnd = Math.min(Math.max(first + Math.ceil((packetEnd - begin) / slot.speed), frame + 1), end);
    const previous = segments.at(-1);
    if (previous && (previous.startSample !== null) === isAvailable)
      segments[segments.length - 1] = { ...previous, end: segmentEnd };
    else segments.push({ first: frame, end: segmentEnd, startSample: isAvailable ? position : null });
    frame = segmentEnd;
  }
  return segments;
}

function isInaudible(plane: Float32Array): boolean {
  for (let frame = 0; frame < plane.length; frame++) if (Math.abs(plane[frame]) >= SILENCE_LEVEL) return false;
  return true;
}

/** Fill frames `first`..`end` with the sound from sample `position` on. */
function fillFrames(
  track: AudioTrack,
  sound: (number: number) => ChannelPlanes | null,
  position: number,
  speed: number,
  planes: ChannelPlanes,
  first: number,
  end: number,
): void {
  const wholeSample = Math.floor(position);
  if (speed === 1 && position === wholeSample) {
    planes.forEach((plane, channel) => {
      copySamples(track, sound, channel, wholeSample, plane.subarray(first, end));
    });
    return;
  }
  const size = Math.ceil((end - first) * speed) + 2 * HALF_TAPS + 2;
  planes.forEach((plane, channel) => {
    const samples = new Float32Array(size);
    copySamples(track, sound, channel, wholeSample - (HALF_TAPS - 1), samples);
    resample(samples, position - wholeSample, speed, plane, first, end);
  });
}

/** Copy the samples of a channel from sample `from` on; those of packets that are not there stay as they are. */
function copySamples(
  track: AudioTrack,
  sound: (number: number) => ChannelPlanes | null,
  channel: number,
  from: number,
  out: Float32Array,
): void {
  for (let filled = 0; filled < out.length; ) {
    const within = from + filled + track.preSkip;
    const number = Math.floor(within / PACKET_SAMPLES);
    const offset = within - number * PACKET_SAMPLES;
    const count = Math.min(PACKET_SAMPLES - offset, out.length - filled);
    const source = number < 0 ? null : sound(number);
    if (source) out.set(source[channel].subarray(offset, offset + count), filled);
    filled += count;
  }
}
