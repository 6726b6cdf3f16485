/** The blocks a viewer holds, and what they show at any instant (`proto/SPEC.md`, Motion block and Scene block). */

import { DamagedBlock } from "../codec/errors";
import { decodeMotionBlock, type MotionBlock } from "../codec/motion-decoder";
import type { MotionTrack } from "../codec/motion-track";
import { decodeSceneBlock, SCENE_VALUE_COUNT, type SceneBlock, type SceneTrack } from "../codec/scene";
import type { Timing } from "../codec/timing";
import { slerp } from "../motion/rotation";
import { JOINT_COUNT, type Pose, restPose } from "../motion/skeleton";

/** Decoded blocks of one track, of each the best rate that came. */
export abstract class TrackBlockStore<Track extends Timing, Block extends { readonly frames: number }> {
  /** Per block: -1 missing, else the best rate held. */
  readonly levels: Int8Array;
  protected readonly blocks: (Block | null)[];

  constructor(readonly track: Track) {
    this.levels = new Int8Array(track.blockCount).fill(-1);
    this.blocks = new Array<Block | null>(track.blockCount).fill(null);
  }

  protected abstract decode(data: Uint8Array, index: number): Block;

  /**
   * Decodes block `index` and keeps it, unless as good a one is here already; whether it was kept.
   *
   * @throws DamagedBlock where it cannot be decoded or is not of this motion
   */
  put(index: number, level: number, encoded: Uint8Array): boolean {
    const { track } = this;
    if (index >= track.blockCount)
      throw new DamagedBlock(`this motion has ${track.blockCount} blocks, and none of index ${index}`);
    if (this.levels[index] >= level) return false;
    const block = this.decode(encoded, index);
    if (block.frames !== track.framesIn(index)) {
      throw new DamagedBlock(`block ${index} has ${track.framesIn(index)} frames, not ${block.frames}`);
    }
    this.blocks[index] = block;
    this.levels[index] = level;
    return true;
  }

  /** Takes over what `other`, of the same track, holds at a better rate. */
  mergeFrom(other: this): void {
    other.levels.forEach((rate, index) => {
      if (rate <= this.levels[index]) return;
      this.levels[index] = rate;
      this.blocks[index] = other.blocks[index];
    });
  }

  /** Microseconds of motion that are here from `position` on without a gap, once around at most. */
  bufferedUs(position: number, loop: boolean): number {
    const { track } = this;
    const first = track.blockAt(position);
    const most = loop ? track.blockCount : track.blockCount - first;
    let count = 0;
    while (count < most && this.levels[(first + count) % track.blockCount] >= 0) count++;
    if (count === 0) return 0;
    if (count === most) return loop ? track.durationUs : Math.max(track.durationUs - position, 0);
    const end = first + count;
    return track.startUs(end % track.blockCount) + (end >= track.blockCount ? track.durationUs : 0) - position;
  }

  /** Whether the track is, to a frame, as long as a motion of `duration` microseconds, or longer. */
  protected coversDuration(duration: number): boolean {
    const { track } = this;
    return track.durationUs + 1e6 / track.fps > duration;
  }

  /** The block after block `index`, in a loop the first after the last; null where there is none, or it is not here. */
  protected nextBlock(index: number, loop: boolean): Block | null {
    return index + 1 < this.track.blockCount ? this.blocks[index + 1] : loop ? this.blocks[0] : null;
  }
}

/** Decoded blocks of one motion, of each the best rate that came. */
export class MotionBlockStore extends TrackBlockStore<MotionTrack, MotionBlock> {
  private readonly nextPose = restPose();

  /**
   * The pose at motion time `position` in microseconds, written into `out`; false, and `out` untouched, where its block is
   * missing. Between the last frame of a block and the first of the next it is the mix of the two where the next is here, at
   * the end of a loop too where the track is as long as the motion, of `duration` microseconds. Past the end of a shorter one
   * it stands still.
   */
  poseAt(position: number, loop: boolean, out: Pose, duration = this.track.durationUs): boolean {
    const { track } = this;
    const index = track.blockAt(position);
    const block = this.blocks[index];
    if (!block) return false;
    const instant = (position * track.fps) / 1e6 - track.firstFrame(index);
    const past = instant - (block.frames - 1);
    const following = this.nextBlock(index, loop && this.coversDuration(duration));
    if (past <= 0 || !following) {
      block.poseAt(Math.min(Math.max(instant, -0.5), block.frames - 0.5), out);
      return true;
    }
    const { nextPose: next } = this;
    const mix = Math.min(past, 1);
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

/** Decoded blocks of one camera or light, of each the best rate that came. */
export class SceneBlockStore extends TrackBlockStore<SceneTrack, SceneBlock> {
  private readonly values = new Float64Array(SCENE_VALUE_COUNT);
  private readonly nextValues = new Float64Array(SCENE_VALUE_COUNT);
  private hasValues = false;

  /**
   * The seven numbers at `position` of a motion of `duration` microseconds, in storage that the next call uses again. Between
   * blocks they are the linear mix, at the end of a loop too where the track is as long as the motion. Past the end of a
   * shorter one, and where a block is missing, they stand still; null before there are any.
   */
  sceneAt(position: number, loop: boolean, duration: number): Float64Array | null {
    const { track, values: shown, nextValues: next } = this;
    const index = track.blockAt(position);
    const block = this.blocks[index];
    if (!block) return this.hasValues ? shown : null;
    this.hasValues = true;
    const instant = (position * track.fps) / 1e6 - track.firstFrame(index);
    const past = instant - (block.frames - 1);
    const following = this.nextBlock(index, loop && this.coversDuration(duration));
    if (past <= 0 || !following) {
      block.valuesAt(Math.min(Math.max(instant, -0.5), block.frames - 0.5), shown);
      return shown;
    }
    const mix = Math.min(past, 1);
    block.valuesAt(block.frames - 1, shown);
    following.valuesAt(0, next);
    for (let number = 0; number < SCENE_VALUE_COUNT; number++) shown[number] += mix * (next[number] - shown[number]);
    return shown;
  }

  protected override decode(data: Uint8Array): SceneBlock {
    return decodeSceneBlock(this.track, data);
  }
}
