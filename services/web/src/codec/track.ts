/** What the blocks of one motion have in common: sent once, in the Description (`proto/SPEC.md`, Track `motion`). */

import type { Figure } from "../motion/skeleton";
import { MOST_FRAMES } from "./coefficients";
import { unpackDancer } from "./dancer";
import { DamagedBlock } from "./errors";
import { channelWeights, type Weights } from "./weights";

export const CODEC = "bunraku.motion/2";

/** Radians in one unit of a block's turn of the root. */
export const TURN_UNIT = 0.1;

// instants are whole microseconds, of six bytes in a Data Packet
const MOST_FPS = 100_000;
const MOST_US = 2 ** 48;
// a day of 1 s blocks; and as many rates as a Data Packet can number
const MOST_BLOCKS = 86_400;
const MOST_RATES = 16;

/** One encoding of a motion: kbit/s of blocks over the duration, mean error in mm over joints and tips, and what none exceeds. */
export interface Rate {
  kbps: number;
  mean: number;
  max: number;
}

/** Constants of a motion's blocks, as in the Description. */
export class MotionTrack {
  /** Number of blocks. */
  readonly blocks: number;
  readonly weights: Weights;

  /**
   * @param fps frames per second
   * @param frames frames of the whole motion
   * @param blockFrames frames of every block but the first and perhaps the last
   * @param firstFrames frames of the first block
   * @param figure the dancer
   * @param reference the joints' reference rotations (72)
   * @param rates what each rate costs and keeps, from the lowest to the highest
   * @param front where the dance faces over its length, radians about y from z towards x
   */
  constructor(
    readonly fps: number,
    readonly frames: number,
    readonly blockFrames: number,
    readonly firstFrames: number,
    readonly figure: Figure,
    readonly reference: Float64Array,
    readonly rates: readonly Rate[] = [],
    readonly front = 0,
  ) {
    this.blocks = 1 + Math.ceil((frames - firstFrames) / blockFrames);
    this.weights = channelWeights(figure);
  }

  /**
   * The track that a Description's map of type `motion` tells of.
   *
   * @throws DamagedBlock where it tells of none that can be played here
   */
  static fromDescription(map: Readonly<Record<string, unknown>>): MotionTrack {
    const { codec, fps, frames, block_frames: blockFrames, first_frames: firstFrames, dancer, rates, front } = map;
    const whole = (value: unknown, most: number) => Number.isInteger(value) && Number(value) >= 1 && Number(value) <= most;
    if (codec !== CODEC) throw new DamagedBlock(`motion is of codec ${String(codec)}; this client reads ${CODEC}`);
    if (!(Number.isFinite(fps) && Number(fps) > 0 && Number(fps) <= MOST_FPS)) {
      throw new DamagedBlock(`motion needs fps, a number above zero and at most ${MOST_FPS}`);
    }
    if (!whole(blockFrames, MOST_FRAMES)) throw new DamagedBlock(`motion needs block_frames, 1..${MOST_FRAMES}`);
    if (!whole(frames, Number(blockFrames) * MOST_BLOCKS)) throw new DamagedBlock("motion needs frames, at least one");
    if ((Number(frames) * 1e6) / Number(fps) >= MOST_US) throw new DamagedBlock("motion needs to last less than 2^48 microseconds");
    if (!whole(firstFrames, Math.min(Number(frames), MOST_FRAMES))) {
      throw new DamagedBlock(`motion needs first_frames, 1..${MOST_FRAMES} and no more than its frames`);
    }
    if (!(dancer instanceof Uint8Array)) throw new DamagedBlock("motion needs a dancer, bytes");
    if (!Array.isArray(rates) || rates.length < 1 || rates.length > MOST_RATES) {
      throw new DamagedBlock(`motion needs rates, 1..${MOST_RATES} of them`);
    }
    const known = rates.map((rate: Partial<Rate> | null, nth): Rate => {
      const { kbps, mean, max } = rate ?? {};
      if (![kbps, mean, max].every(Number.isFinite)) throw new DamagedBlock(`rate ${nth} needs kbps, mean and max, numbers`);
      return { kbps: kbps!, mean: mean!, max: max! };
    });
    const { figure, reference } = unpackDancer(dancer);
    return new MotionTrack(
      Number(fps), Number(frames), Number(blockFrames), Number(firstFrames), figure, reference, known,
      Number.isFinite(front) ? Number(front) : 0,
    );
  }

  /** Length in microseconds. */
  get durationUs(): number {
    return Math.round((this.frames * 1e6) / this.fps);
  }

  /** Frame of the motion with which block `index` starts. */
  firstFrame(index: number): number {
    return index > 0 ? this.firstFrames + (index - 1) * this.blockFrames : 0;
  }

  /** Frames of block `index`. */
  framesIn(index: number): number {
    return index > 0 ? Math.min(this.blockFrames, this.frames - this.firstFrame(index)) : this.firstFrames;
  }

  /** Motion time of the first frame of block `index`, microseconds. */
  startUs(index: number): number {
    return Math.round((this.firstFrame(index) * 1e6) / this.fps);
  }

  /** Index of the block that holds the instant `positionUs`, kept within the motion. */
  blockAt(positionUs: number): number {
    // a block's start is rounded to the microsecond
    const frame = ((positionUs + 1) * this.fps) / 1e6;
    const index = frame >= this.firstFrames ? Math.floor((frame - this.firstFrames) / this.blockFrames) + 1 : 0;
    return Math.min(index, this.blocks - 1);
  }
}
