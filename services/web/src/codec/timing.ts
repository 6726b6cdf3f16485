/** Division of a track into blocks over time, the same for motion, scene and audio (`proto/messages.md`, 3.2). */

import { DamagedBlock } from "./errors";

/** Limit of the frames of a block. */
export const MAX_BLOCK_FRAMES = 512;

// instants are integer microseconds, and a duration is less than 2^48 of them
const MAX_FPS = 100_000;
const MAX_DURATION_US = 2 ** 48;
// a day of blocks of 1 s; a Data message has four bits for the level
const MAX_BLOCKS = 86_400;
const MAX_LEVELS = 16;

/**
 * One encoding of a track: bitrate over its duration, mean error and error bound in mm (`proto/messages.md`, 3.2).
 */
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
   * @param blockFrames frames of all blocks but the first; the last may be shorter
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

  /** Duration in microseconds. */
  get durationUs(): number {
    return Math.round((this.frames * 1e6) / this.fps);
  }

  /** Returns the frame of the motion with which block `index` starts. */
  firstFrame(index: number): number {
    return index > 0 ? this.firstFrames + (index - 1) * this.blockFrames : 0;
  }

  /** Returns the number of frames of block `index`. */
  framesIn(index: number): number {
    return index > 0 ? Math.min(this.blockFrames, this.frames - this.firstFrame(index)) : this.firstFrames;
  }

  /** Returns the motion time of the first frame of block `index`, microseconds. */
  startUs(index: number): number {
    return Math.round((this.firstFrame(index) * 1e6) / this.fps);
  }

  /** Returns the index of the block at a motion time, limited to the blocks of the track. */
  blockAt(positionUs: number): number {
    // a start is rounded to the microsecond and may be slightly before its frame
    const frame = ((positionUs + 1) * this.fps) / 1e6;
    const index = frame >= this.firstFrames ? Math.floor((frame - this.firstFrames) / this.blockFrames) + 1 : 0;
    return Math.min(index, this.blockCount - 1);
  }
}

/** A Description's map of one track. */
export type TrackDescription = Readonly<Record<string, unknown>>;

/**
 * Returns the timing in a Description's map of a track.
 *
 * @param trackName name of the track in error messages
 * @throws DamagedBlock
 */
export function parseTiming(description: TrackDescription, trackName: string): Timing {
  const { fps, frames, block_frames: blockFrames, first_frames: firstFrames } = description;
  const isCount = (value: unknown, limit: number) =>
    Number.isInteger(value) && Number(value) >= 1 && Number(value) <= limit;
  if (!(Number.isFinite(fps) && Number(fps) > 0 && Number(fps) <= MAX_FPS)) {
    throw new DamagedBlock(`Invalid ${trackName} track: fps must be above zero and at most ${MAX_FPS}.`);
  }
  if (!isCount(blockFrames, MAX_BLOCK_FRAMES))
    throw new DamagedBlock(`Invalid ${trackName} track: block_frames must be 1..${MAX_BLOCK_FRAMES}.`);
  if (!isCount(frames, Number(blockFrames) * MAX_BLOCKS))
    throw new DamagedBlock(`Invalid ${trackName} track: frames must be 1..${MAX_BLOCKS} times block_frames.`);
  if ((Number(frames) * 1e6) / Number(fps) >= MAX_DURATION_US)
    throw new DamagedBlock(`Invalid ${trackName} track: its duration must be less than 2^48 microseconds.`);
  if (!isCount(firstFrames, Math.min(Number(frames), MAX_BLOCK_FRAMES))) {
    throw new DamagedBlock(
      `Invalid ${trackName} track: first_frames must be 1..${MAX_BLOCK_FRAMES} and at most frames.`,
    );
  }
  return new Timing(Number(fps), Number(frames), Number(blockFrames), Number(firstFrames));
}

/**
 * Returns the bitrate levels in a Description's map of a track, lowest first.
 *
 * @throws DamagedBlock
 */
export function parseLadder({ rates }: TrackDescription, trackName: string): BitrateLevel[] {
  if (!Array.isArray(rates) || rates.length < 1 || rates.length > MAX_LEVELS) {
    throw new DamagedBlock(`Invalid ${trackName} track: rates must have 1..${MAX_LEVELS} entries.`);
  }
  return rates.map((rate: Partial<BitrateLevel> | null, level): BitrateLevel => {
    const { kbps, mean, max } = rate ?? {};
    if (![kbps, mean, max].every(Number.isFinite))
      throw new DamagedBlock(`Invalid ${trackName} track: rate ${level} must have kbps, mean and max, numbers.`);
    return { kbps: kbps!, mean: mean!, max: max! };
  });
}
