/** What a slot sounds like: the motion's sound at the positions that its frames have, and joints that do not click. Pure. */

import { type AudioTrack, PACKET, SAMPLE_RATE } from "../codec/audio";
import type { Span } from "../playout/spans";
import type { Planes } from "./decoded";
import { HALF, resample } from "./resample";
import { type Slot, SLOT, SLOT_US } from "./schedule";

/** Frames in which a jump is made good: 8 ms. */
const JOINT = 384;

/** A sound that goes on is where it was expected to within so many samples: clock times have no finer steps. */
const SAME = 2;

/** What nobody hears, full scale being one: -80 dB. */
const SILENCE = 1e-4;

/** Where the sound stands between two slots. */
export interface Joint {
  /** The sample that would follow; null where none sounded. */
  readonly place: number | null;
  /** What was put out last, of each channel. */
  readonly last: readonly number[];
  /** Of a jump still being made good: how large it was, of each channel, and how long ago, in frames. */
  readonly jump: readonly number[];
  readonly since: number;
}

export interface Sounding {
  /** `SLOT` frames of each channel. */
  readonly planes: Planes;
  /** Whether nothing in it is heard. */
  readonly silent: boolean;
  readonly joint: Joint;
}

/** Frames `first`..`end` of a slot that sound on from sample `place`, or, where that is null, are silent. */
interface Piece {
  readonly first: number;
  readonly end: number;
  readonly place: number | null;
}

/** Before anything sounds. */
export function quiet(channels: number): Joint {
  const zeros = new Array<number>(channels).fill(0);
  return { place: null, last: zeros, jump: zeros, since: JOINT };
}

/** The packets that spans of motion need, in the order in which they are heard; one may be told twice. */
export function packetsOf(track: AudioTrack, spans: readonly Span[]): number[] {
  const numbers: number[] = [];
  for (const { from, to, position, moving } of spans) {
    if (!moving) continue;
    const around = (HALF * 1e6) / SAMPLE_RATE;
    const first = Math.max(track.packetAt(position - around), 0);
    const last = Math.min(track.packetAt(position + to - from + around), track.packets - 1);
    for (let number = first; number <= last; number++) numbers.push(number);
  }
  return numbers;
}

/**
 * The sound of `slot`, whose stage times are the `spans`, after one that ended in `before`. Where a packet that is needed is not
 * decoded (`sound` gives null) it is silent.
 */
export function render(track: AudioTrack, sound: (number: number) => Planes | null, slot: Slot, spans: readonly Span[], before: Joint): Sounding {
  const planes = Array.from({ length: track.channels }, () => new Float32Array(SLOT));
  let { place, last, jump, since } = before;
  for (const piece of spans.flatMap((span) => piecesOf(track, sound, slot, span))) {
    const { first, end } = piece;
    if (first >= end) continue;
    const goesOn = piece.place === null ? place === null : place !== null && Math.abs(piece.place - place) < SAME;
    const from = goesOn ? place : piece.place;
    if (from !== null) fill(track, sound, from, slot.speed, planes, first, end);
    if (!goesOn) {
      jump = planes.map((plane, channel) => last[channel] - plane[first]);
      since = 0;
    }
    for (let frame = first; frame < end && since < JOINT; frame++, since++) {
      const share = 0.5 + 0.5 * Math.cos((Math.PI * since) / JOINT);
      planes.forEach((plane, channel) => (plane[frame] += share * jump[channel]));
    }
    last = planes.map((plane) => plane[end - 1]);
    place = from === null ? null : from + (end - first) * slot.speed;
  }
  const silent = planes.every((plane) => plane.every((sample) => Math.abs(sample) < SILENCE));
  return { planes, silent, joint: { place, last, jump, since } };
}

/** A span of a slot as pieces that sound or do not. */
function piecesOf(track: AudioTrack, sound: (number: number) => Planes | null, slot: Slot, span: Span): Piece[] {
  const frameOf = (stage: number) => Math.min(Math.max(Math.round(((stage - slot.stage) / (slot.speed * SLOT_US)) * SLOT), 0), SLOT);
  const [first, end] = [frameOf(span.from), frameOf(span.to)];
  if (!span.moving) return [{ first, end, place: null }];
  const begin = (span.position * SAMPLE_RATE) / 1e6;
  const pieces: Piece[] = [];
  for (let frame = first; frame < end; ) {
    const place = begin + (frame - first) * slot.speed;
    const number = Math.floor((place + track.preSkip) / PACKET);
    const over = place >= track.samples;
    const here = !over && number >= 0 && sound(number) !== null;
    const border = over ? Infinity : Math.min(track.firstSample(number + 1), track.samples);
    const until = Math.min(Math.max(first + Math.ceil((border - begin) / slot.speed), frame + 1), end);
    const before = pieces.at(-1);
    if (before && (before.place !== null) === here) pieces[pieces.length - 1] = { ...before, end: until };
    else pieces.push({ first: frame, end: until, place: here ? place : null });
    frame = until;
  }
  return pieces;
}

/** Fills frames `first`..`end` with the sound from sample `place` on. */
function fill(track: AudioTrack, sound: (number: number) => Planes | null, place: number, speed: number, planes: Planes, first: number, end: number): void {
  const whole = Math.floor(place);
  const from = whole - (HALF - 1);
  const size = Math.ceil((end - first) * speed) + 2 * HALF + 2;
  planes.forEach((plane, channel) => {
    const samples = new Float32Array(size);
    for (let at = 0; at < size; ) {
      const within = from + at + track.preSkip;
      const number = Math.floor(within / PACKET);
      const offset = within - number * PACKET;
      const count = Math.min(PACKET - offset, size - at);
      const source = number < 0 ? null : sound(number);
      if (source) samples.set(source[channel].subarray(offset, offset + count), at);
      at += count;
    }
    resample(samples, place - whole, speed, plane, first, end);
  });
}
