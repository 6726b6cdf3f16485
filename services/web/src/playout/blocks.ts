/** The blocks a viewer holds, and what they show at any instant (`proto/SPEC.md`, Motion block and Scene block). */

import { decodeBlock, type MotionBlock } from "../codec/decode";
import { DamagedBlock } from "../codec/errors";
import { decodeScene, NUMBERS, type SceneBlock, type SceneTrack } from "../codec/scene";
import type { Timing } from "../codec/timing";
import type { MotionTrack } from "../codec/track";
import { slerp } from "../motion/rotation";
import { JOINT_COUNT, type Pose, restPose } from "../motion/skeleton";

/** Decoded blocks of one track, of each the best rate that came. */
export abstract class Store<Track extends Timing, Block extends { readonly frames: number }> {
  /** Per block: -1 missing, else the best rate held. */
  readonly rates: Int8Array;
  protected readonly blocks: (Block | null)[];

  constructor(readonly track: Track) {
    this.rates = new Int8Array(track.blocks).fill(-1);
    this.blocks = new Array<Block | null>(track.blocks).fill(null);
  }

  protected abstract decode(data: Uint8Array, index: number): Block;

  /**
   * Decodes block `index` and keeps it, unless as good a one is here already; whether it was kept.
   *
   * @throws DamagedBlock where it cannot be decoded or is not of this motion
   */
  put(index: number, rate: number, data: Uint8Array): boolean {
    const { track } = this;
    if (index >= track.blocks) throw new DamagedBlock(`this motion has ${track.blocks} blocks, and none of index ${index}`);
    if (this.rates[index] >= rate) return false;
    const block = this.decode(data, index);
    if (block.frames !== track.framesIn(index)) {
      throw new DamagedBlock(`block ${index} has ${track.framesIn(index)} frames, not ${block.frames}`);
    }
    this.blocks[index] = block;
    this.rates[index] = rate;
    return true;
  }

  /** Takes over what `other`, of the same track, holds at a better rate. */
  adopt(other: this): void {
    other.rates.forEach((rate, index) => {
      if (rate <= this.rates[index]) return;
      this.rates[index] = rate;
      this.blocks[index] = other.blocks[index];
    });
  }

  /** Microseconds of motion that are here from `position` on without a gap, once around at most. */
  ahead(position: number, loop: boolean): number {
    const { track } = this;
    const first = track.blockAt(position);
    const most = loop ? track.blocks : track.blocks - first;
    let count = 0;
    while (count < most && this.rates[(first + count) % track.blocks] >= 0) count++;
    if (count === 0) return 0;
    if (count === most) return loop ? track.durationUs : Math.max(track.durationUs - position, 0);
    const end = first + count;
    return track.startUs(end % track.blocks) + (end >= track.blocks ? track.durationUs : 0) - position;
  }

  /** Whether the track is, to a frame, as long as a motion of `duration` microseconds, or longer. */
  protected lasts(duration: number): boolean {
    const { track } = this;
    return track.durationUs + 1e6 / track.fps > duration;
  }

  /** The block after block `index`, in a loop the first after the last; null where there is none, or it is not here. */
  protected following(index: number, loop: boolean): Block | null {
    return index + 1 < this.track.blocks ? this.blocks[index + 1] : loop ? this.blocks[0] : null;
  }
}

/** Decoded blocks of one motion, of each the best rate that came. */
export class BlockStore extends Store<MotionTrack, MotionBlock> {
  private readonly next = restPose();

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
    const following = this.following(index, loop && this.lasts(duration));
    if (past <= 0 || !following) {
      block.at(Math.min(Math.max(instant, -0.5), block.frames - 0.5), out);
      return true;
    }
    const { next } = this;
    const mix = Math.min(past, 1);
    block.at(block.frames - 1, out);
    following.at(0, next);
    for (let axis = 0; axis < 3; axis++) out.root[axis] += mix * (next.root[axis] - out.root[axis]);
    for (let at = 0; at < JOINT_COUNT * 4; at += 4) slerp(out.rotations, at, out.rotations, at, next.rotations, at, mix);
    return true;
  }

  protected override decode(data: Uint8Array): MotionBlock {
    return decodeBlock(this.track, data);
  }
}

/** Decoded blocks of one camera or light, of each the best rate that came. */
export class SceneStore extends Store<SceneTrack, SceneBlock> {
  private readonly shown = new Float64Array(NUMBERS);
  private readonly next = new Float64Array(NUMBERS);
  private any = false;

  /**
   * The seven numbers at `position` of a motion of `duration` microseconds, in storage that the next call uses again. Between
   * blocks they are the linear mix, at the end of a loop too where the track is as long as the motion. Past the end of a
   * shorter one, and where a block is missing, they stand still; null before there are any.
   */
  sceneAt(position: number, loop: boolean, duration: number): Float64Array | null {
    const { track, shown, next } = this;
    const index = track.blockAt(position);
    const block = this.blocks[index];
    if (!block) return this.any ? shown : null;
    this.any = true;
    const instant = (position * track.fps) / 1e6 - track.firstFrame(index);
    const past = instant - (block.frames - 1);
    const following = this.following(index, loop && this.lasts(duration));
    if (past <= 0 || !following) {
      block.at(Math.min(Math.max(instant, -0.5), block.frames - 0.5), shown);
      return shown;
    }
    const mix = Math.min(past, 1);
    block.at(block.frames - 1, shown);
    following.at(0, next);
    for (let number = 0; number < NUMBERS; number++) shown[number] += mix * (next[number] - shown[number]);
    return shown;
  }

  protected override decode(data: Uint8Array): SceneBlock {
    return decodeScene(this.track, data);
  }
}
