/** Live poses of a motion's performers (`proto/playback.md`, 4.10). */

import { DamagedBlock } from "../codec/errors";
import type { Pose } from "../motion/skeleton";
import type { Live } from "../wire/live";
import type { MotionBlockStore } from "./block-store";
import { LiveBuffer } from "./live-buffer";

/** Live poses of all performers, by number. */
export class LivePoses {
  private buffers: (LiveBuffer | undefined)[] = [];

  /** @param performers stores of the performers, as far as described; live storage */
  constructor(private performers: readonly (MotionBlockStore | null)[]) {}

  /** Discard all poses, and use the performers of another motion. */
  reset(performers: readonly (MotionBlockStore | null)[]): void {
    this.performers = performers;
    this.buffers = [];
  }

  /**
   * Add the poses of a message that arrived at local `nowMs`; those of performers that are not described are skipped.
   * Return the number of damaged blocks, which have no effect.
   */
  put({ due, frames, blocks }: Live, nowMs: number): number {
    let damagedCount = 0;
    for (const [performer, block] of blocks) {
      const store = this.performers[performer];
      if (!store) continue;
      this.buffers[performer] ??= new LiveBuffer(store.track);
      try {
        this.buffers[performer].put(due, frames, block, nowMs);
      } catch (error) {
        if (!(error instanceof DamagedBlock)) throw error;
        damagedCount++;
      }
    }
    return damagedCount;
  }

  /** Write the pose of a performer at `clock` to `out`. Return false, and leave `out` unchanged, if there is none. */
  poseAt(performer: number, clock: number, out: Pose): boolean {
    return this.buffers[performer]?.poseAt(clock, out) ?? false;
  }

  /** Return the largest of the performers' median ages, milliseconds, or null if nobody is live. */
  ageMs(nowMs: number): number | null {
    const ages = this.buffers.map((buffer) => buffer?.latency.ageMs(nowMs) ?? null).filter((age) => age !== null);
    return ages.length > 0 ? Math.max(...ages) : null;
  }
}
