/** When the blocks of a track are, the same of a motion and of the scene about it (`proto/SPEC.md`, Description). */

import { MAX_BLOCK_FRAMES } from "./coefficients";
import { DamagedBlock } from "./errors";

// instants are whole microseconds, a track is shorter than 2^48 of them
const MAX_FPS = 100_000;
const MAX_DURATION_US = 2 ** 48;
// a day of 1 s blocks; and as many rates as a Data Packet can number
const MAX_BLOCKS = 86_400;
const MAX_LEVELS = 16;

/** One encoding of a track: kbit/s of blocks over the duration, mean error in mm (SPEC.md says of what), and what none exceeds. */
export interface BitrateLevel {
  kbps: number;
  mean: number;
  max: number;
}

/** Frames and blocks of a track. */
export class Timing {
  /** Number of blocks. */
  readonly blockCount: number;

  /**
   * @param fps frames per second
   * @param frames frames of the whole track
   * @param blockFrames frames of every block but the first and perhaps the last
   * @param firstFrames frames of the first block
   */
  constructor(
    readonly fps: number,
    readonly frames: number,
    readonly blockFrames: number,
    readonly firstFrames: number,
  ) {
    this.blockCount = 1 + Math.ceil((frames - firstFrames) / blockFrames);
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
    return Math.min(index, this.blockCount - 1);
  }
}

/** A Description's map of one track. */
export type TrackDescription = Readonly<Record<string, unknown>>;

/**
 * The timing that the map of a track tells of; `what` names it in messages.
 *
 * @throws DamagedBlock where it tells of none that can be played here
 */
export function parseTiming(description: TrackDescription, trackName: string): Timing {
  const { fps, frames, block_frames: blockFrames, first_frames: firstFrames } = description;
  const whole = (value: unknown, most: number) =>
    Number.isInteger(value) && Number(value) >= 1 && Number(value) <= most;
  if (!(Number.isFinite(fps) && Number(fps) > 0 && Number(fps) <= MAX_FPS)) {
    throw new DamagedBlock(`${trackName} needs fps, a number above zero and at most ${MAX_FPS}`);
  }
  if (!whole(blockFrames, MAX_BLOCK_FRAMES))
    throw new DamagedBlock(`${trackName} needs block_frames, 1..${MAX_BLOCK_FRAMES}`);
  if (!whole(frames, Number(blockFrames) * MAX_BLOCKS))
    throw new DamagedBlock(`${trackName} needs frames, at least one`);
  if ((Number(frames) * 1e6) / Number(fps) >= MAX_DURATION_US)
    throw new DamagedBlock(`${trackName} needs to last less than 2^48 microseconds`);
  if (!whole(firstFrames, Math.min(Number(frames), MAX_BLOCK_FRAMES))) {
    throw new DamagedBlock(`${trackName} needs first_frames, 1..${MAX_BLOCK_FRAMES} and no more than its frames`);
  }
  return new Timing(Number(fps), Number(frames), Number(blockFrames), Number(firstFrames));
}

/**
 * What each rate of a track costs and keeps, from the lowest to the highest.
 *
 * @throws DamagedBlock
 */
export function parseLadder({ rates }: TrackDescription, trackName: string): BitrateLevel[] {
  if (!Array.isArray(rates) || rates.length < 1 || rates.length > MAX_LEVELS) {
    throw new DamagedBlock(`${trackName} needs rates, 1..${MAX_LEVELS} of them`);
  }
  return rates.map((rate: Partial<BitrateLevel> | null, nth): BitrateLevel => {
    const { kbps, mean, max } = rate ?? {};
    if (![kbps, mean, max].every(Number.isFinite))
      throw new DamagedBlock(`rate ${nth} needs kbps, mean and max, numbers`);
    return { kbps: kbps!, mean: mean!, max: max! };
  });
}
