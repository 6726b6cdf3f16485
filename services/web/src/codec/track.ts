/** What the blocks of one motion have in common: sent once, in the Description (`proto/SPEC.md`, Track `motion`). */

import { fromRotationVector } from "../motion/rotation";
import { CHANNEL_COUNT, type Figure, JOINT_COUNT, PARENTS, TIPS } from "../motion/skeleton";
import { DamagedBlock } from "./errors";

export const CODEC = "bunraku.motion/1";

/** Metres in one unit of the figure's 16-bit offsets. */
export const FIGURE_UNIT = 1e-4;

/** Radians in one unit of an 8-bit rotation vector. */
export const REFERENCE_UNIT = Math.PI / 127;

/** Most frames a block may have. */
export const MOST_FRAMES = 1_000;

// a day of 1 s blocks; and as many rates as a Data Packet can number
const MOST_BLOCKS = 86_400;
const MOST_RATES = 16;

/** One encoding of a motion: kbit/s of Data over the duration, and its mean and max error in mm over joints and tips. */
export interface Rate {
  kbps: number;
  mean: number;
  max: number;
}

/** The figure of 138 bytes: 18 offsets and 5 tips, each 3 x i16 little-endian in `FIGURE_UNIT`. */
export function unpackFigure(data: Uint8Array): Figure {
  const numbers = 3 * (JOINT_COUNT + TIPS.length);
  if (data.length !== 2 * numbers) throw new DamagedBlock(`a figure has ${2 * numbers} bytes, not ${data.length}`);
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  const figure = { offsets: new Float64Array(JOINT_COUNT * 3), tips: new Float64Array(JOINT_COUNT * 3) };
  for (let i = 0; i < JOINT_COUNT * 3; i++) figure.offsets[i] = view.getInt16(2 * i, true) * FIGURE_UNIT;
  TIPS.forEach((joint, tip) => {
    for (let axis = 0; axis < 3; axis++) {
      figure.tips[joint * 3 + axis] = view.getInt16(2 * ((JOINT_COUNT + tip) * 3 + axis), true) * FIGURE_UNIT;
    }
  });
  return figure;
}

/** The rotations (72, w x y z; the root's the identity) that each joint's channel is relative to, of 51 bytes. */
export function unpackReference(data: Uint8Array): Float64Array {
  const numbers = 3 * (CHANNEL_COUNT - 2);
  if (data.length !== numbers) throw new DamagedBlock(`references have ${numbers} bytes, not ${data.length}`);
  const view = new Int8Array(data.buffer, data.byteOffset, data.byteLength);
  const reference = new Float64Array(JOINT_COUNT * 4);
  reference[0] = 1;
  for (let joint = 1; joint < JOINT_COUNT; joint++) {
    const at = (joint - 1) * 3;
    const [x, y, z] = [view[at], view[at + 1], view[at + 2]].map((unit) => unit * REFERENCE_UNIT);
    fromRotationVector(reference, joint * 4, x, y, z);
  }
  return reference;
}

/** How far a turn of each channel moves the body (19): SPEC, Quantiser. */
export function levers(figure: Figure): Float64Array {
  const square = (v: Float64Array, joint: number) =>
    v[joint * 3] ** 2 + v[joint * 3 + 1] ** 2 + v[joint * 3 + 2] ** 2;
  const points = JOINTS_AND_TIPS.slice();
  const squares = Float64Array.from(points, (_, joint) => 0.06 ** 2 + square(figure.tips, joint));
  for (let joint = JOINT_COUNT - 1; joint > 0; joint--) {
    squares[PARENTS[joint]] += points[joint] ** 0.45 * square(figure.offsets, joint);
    points[PARENTS[joint]] += points[joint];
  }
  return Float64Array.of(2.6, ...squares.map(Math.sqrt));
}

const JOINTS_AND_TIPS = Array.from({ length: JOINT_COUNT }, (_, joint) => (TIPS.includes(joint) ? 2 : 1));

/** Constants of a motion's blocks, as in the Description. */
export class MotionTrack {
  /** Number of blocks. */
  readonly blocks: number;
  readonly levers: Float64Array;

  /**
   * @param fps frames per second
   * @param frames frames of the whole motion
   * @param blockFrames frames of every block but perhaps the last
   * @param figure the dancer
   * @param reference the joints' reference rotations (72)
   * @param rates what each rate costs and keeps, from the lowest to the highest
   * @param front where the dance faces over its length, radians about y from z towards x
   */
  constructor(
    readonly fps: number,
    readonly frames: number,
    readonly blockFrames: number,
    readonly figure: Figure,
    readonly reference: Float64Array,
    readonly rates: readonly Rate[] = [],
    readonly front = 0,
  ) {
    this.blocks = Math.ceil(frames / blockFrames);
    this.levers = levers(figure);
  }

  /**
   * The track that a Description's map of type `motion` tells of.
   *
   * @throws DamagedBlock where it tells of none that can be played here
   */
  static fromDescription(map: Readonly<Record<string, unknown>>): MotionTrack {
    const { codec, fps, frames, block_frames: blockFrames, figure, reference, rates, front } = map;
    const whole = (value: unknown, most: number) => Number.isInteger(value) && Number(value) >= 1 && Number(value) <= most;
    if (codec !== CODEC) throw new DamagedBlock(`motion is of codec ${String(codec)}; this client reads ${CODEC}`);
    if (!Number.isFinite(fps) || Number(fps) <= 0) throw new DamagedBlock("motion needs fps, a number above zero");
    if (!whole(blockFrames, MOST_FRAMES)) throw new DamagedBlock(`motion needs block_frames, 1..${MOST_FRAMES}`);
    if (!whole(frames, Number(blockFrames) * MOST_BLOCKS)) throw new DamagedBlock("motion needs frames, at least one");
    if (!(figure instanceof Uint8Array && reference instanceof Uint8Array)) {
      throw new DamagedBlock("motion needs figure and reference, bytes");
    }
    if (!Array.isArray(rates) || rates.length < 1 || rates.length > MOST_RATES) {
      throw new DamagedBlock(`motion needs rates, 1..${MOST_RATES} of them`);
    }
    const known = rates.map((rate: Partial<Rate> | null, nth): Rate => {
      const { kbps, mean, max } = rate ?? {};
      if (![kbps, mean, max].every(Number.isFinite)) throw new DamagedBlock(`rate ${nth} needs kbps, mean and max, numbers`);
      return { kbps: kbps!, mean: mean!, max: max! };
    });
    return new MotionTrack(
      Number(fps), Number(frames), Number(blockFrames), unpackFigure(figure), unpackReference(reference), known,
      Number.isFinite(front) ? Number(front) : 0,
    );
  }

  /** Length in microseconds. */
  get durationUs(): number {
    return Math.round((this.frames * 1e6) / this.fps);
  }

  /** Frames of block `index`. */
  framesIn(index: number): number {
    return Math.min(this.blockFrames, this.frames - index * this.blockFrames);
  }

  /** Motion time of the first frame of block `index`, microseconds. */
  startUs(index: number): number {
    return Math.round((index * this.blockFrames * 1e6) / this.fps);
  }

  /** Index of the block that holds the instant `positionUs`, kept within the motion. */
  blockAt(positionUs: number): number {
    const index = Math.floor((positionUs * this.fps) / 1e6 / this.blockFrames + 1e-6);
    return Math.min(Math.max(index, 0), this.blocks - 1);
  }
}
