/** Blocks that a viewer holds, and their values at any position (`proto/codec.md`, 2.8 and 2.14). */

import { DamagedBlock } from "../codec/errors";
import { decodeMotionBlock, type MotionBlock } from "../codec/motion-decoder";
import type { MotionTrack } from "../codec/motion-track";
import { decodeSceneBlock, SCENE_VALUE_COUNT, type SceneBlock, type SceneTrack } from "../codec/scene";
import type { Timing } from "../codec/timing";
import { slerp } from "../motion/rotation";
import { JOINT_COUNT, type Pose, restPose } from "../motion/skeleton";

/** Place of a motion time in the stored blocks. */
interface BlockLocation<Block> {
  readonly block: Block;
  /** Instant in the block, in frames. */
  readonly instant: number;
  /** Following block if the instant is past the last frame and the block is stored, else null. */
  readonly following: Block | null;
}

/** Decoded blocks of one track, each at the highest level received. */
export abstract class TrackBlockStore<Track extends Timing, Block extends { readonly frames: number }> {
  /** Level of each block, -1 if it is missing. */
  readonly levels: Int8Array;
  private readonly blocks: (Block | null)[];

  constructor(readonly track: Track) {
    this.levels = new Int8Array(track.blockCount).fill(-1);
    this.blocks = new Array<Block | null>(track.blockCount).fill(null);
  }

  protected abstract decode(data: Uint8Array, index: number): Block;

  /**
   * Decode and store block `index`, unless it is stored at this level or a higher one. Return true if it was stored.
   *
   * @throws DamagedBlock if the block cannot be decoded or does not belong to this track
   */
  put(index: number, level: number, encoded: Uint8Array): boolean {
    const { track } = this;
    if (index >= track.blockCount)
      throw new DamagedBlock(`Block ${index} does not belong to this track, which has ${track.blockCount} blocks.`);
    if (this.levels[index] >= level) return false;
    const block = this.decode(encoded, index);
    if (block.frames !== track.framesIn(index)) {
      throw new DamagedBlock(`Block ${index} has ${block.frames} frames, expected ${track.framesIn(index)}.`);
    }
    this.blocks[index] = block;
    this.levels[index] = level;
    return true;
  }

  /** Copy each block that `other`, a store of the same track, holds at a higher level. */
  mergeFrom(other: this): void {
    other.levels.forEach((level, index) => {
      if (level <= this.levels[index]) return;
      this.levels[index] = level;
      this.blocks[index] = other.blocks[index];
    });
  }

  /** Return the duration stored from `position` on without a gap, at most one loop; microseconds. */
  bufferedUs(position: number, loop: boolean): number {
    const { track } = this;
    const first = track.blockAt(position);
    const maxCount = loop ? track.blockCount : track.blockCount - first;
    let count = 0;
    while (count < maxCount && this.levels[(first + count) % track.blockCount] >= 0) count++;
    if (count === 0) return 0;
    if (count === maxCount) return loop ? track.durationUs : Math.max(track.durationUs - position, 0);
    const end = first + count;
    return track.startUs(end % track.blockCount) + (end >= track.blockCount ? track.durationUs : 0) - position;
  }

  /**
   * Find the block at motion time `position`, or null if it is missing. At the end of a loop the first block follows,
   * if the track is, to a frame, as long as the motion (`duration` microseconds) or longer.
   */
  protected findBlock(position: number, loop: boolean, duration: number): BlockLocation<Block> | null {
    const { track } = this;
    const index = track.blockAt(position);
    const block = this.blocks[index];
    if (!block) return null;
    const instant = (position * track.fps) / 1e6 - track.firstFrame(index);
    const wraps = loop && track.durationUs + 1e6 / track.fps > duration;
    const following =
      instant <= block.frames - 1
        ? null
        : index + 1 < track.blockCount
          ? this.blocks[index + 1]
          : wraps
            ? this.blocks[0]
            : null;
    return { block, instant, following };
  }
}

/** Decoded blocks of one performer's motion, each at the highest level received. */
export class MotionBlockStore extends TrackBlockStore<MotionTrack, MotionBlock> {
  private readonly nextPose = restPose();

  /**
   * Write the pose at motion time `position` (microseconds) to `out`. Return false, and leave `out` unchanged, if its
   * block is missing.
   *
   * Between the last frame of a block and the first of the next, the two are interpolated if the next is stored. This
   * holds at the end of a loop, too, if the track is as long as the motion (`duration` microseconds, by default that of
   * the track). Past the end of a shorter track the pose stays constant.
   */
  poseAt(position: number, loop: boolean, out: Pose, duration = this.track.durationUs): boolean {
    const location = this.findBlock(position, loop, duration);
    if (!location) return false;
    const { block, instant, following } = location;
    if (!following) {
      block.poseAt(Math.min(Math.max(instant, -0.5), block.frames - 0.5), out);
      return true;
    }
    const { nextPose: next } = this;
    const mix = Math.min(instant - (block.frames - 1), 1);
    block.poseAt(block.frames - 1, out);
    following.poseAt(0, next);
    for (let axis = 0; axis < 3; axis++) out.root[axis] += mix * (next.root[axis] - out.root[axis]);
    for (let at = 0; at < JOINT_COUNT * 4; at += 4)
      slerp(out.rotations, at, out.rotations, at, next.rotations, at, mix);
    return true;
  }

  protected override decode(data: Uint8Array): MotionBlock {
    return decodeMotionBlock(this.track, data);
  }
}

/** Decoded blocks of one camera or light, each at the highest level received. */
export class SceneBlockStore extends TrackBlockStore<SceneTrack, SceneBlock> {
  private readonly values = new Float64Array(SCENE_VALUE_COUNT);
  private readonly nextValues = new Float64Array(SCENE_VALUE_COUNT);
  private hasValues = false;

  /**
   * Return the seven values at `position` of a motion of `duration` microseconds, in storage that the next call reuses.
   *
   * They are interpolated linearly between blocks, and at the end of a loop if the track is as long as the motion. Past
   * the end of a shorter track, and while a block is missing, they stay constant; null before the first stored block.
   */
  sceneAt(position: number, loop: boolean, duration: number): Float64Array | null {
    const { values, nextValues } = this;
    const location = this.findBlock(position, loop, duration);
    if (!location) return this.hasValues ? values : null;
    this.hasValues = true;
    const { block, instant, following } = location;
    if (!following) {
      block.valuesAt(Math.min(Math.max(instant, -0.5), block.frames - 0.5), values);
      return values;
    }
    const mix = Math.min(instant - (block.frames - 1), 1);
    block.valuesAt(block.frames - 1, values);
    following.valuesAt(0, nextValues);
    for (let n = 0; n < SCENE_VALUE_COUNT; n++) values[n] += mix * (nextValues[n] - values[n]);
    return values;
  }

  protected override decode(data: Uint8Array): SceneBlock {
    return decodeSceneBlock(this.track, data);
  }
}
