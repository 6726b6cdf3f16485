/** Whole poses of one live performer, by the clock times at which they are due (`proto/playback.md`, 4.10). */

import { LiveTrack } from "../codec/live";
import type { MotionTrack } from "../codec/motion-track";
import { slerp } from "../motion/rotation";
import { copyPose, JOINT_COUNT, type Pose, restPose } from "../motion/skeleton";
import { LIVE_FRAME_INTERVAL_US, type LiveBlock } from "../wire/live";
import { LiveLatency } from "./live-latency";

/**
 * Longest gap between messages that is bridged, and time for which the last pose is held, microseconds: on a
 * constrained link, blocks of the stored motion delay the first messages by 0.4 s.
 */
export const LIVE_HOLD_US = 500_000;
/** Capacity of the buffer: four seconds. */
export const MAX_FRAMES = 256;

interface LiveFrame {
  due: number;
  readonly pose: Pose;
}

/** Last poses of one performer, in order of their due times. */
export class LiveBuffer {
  private readonly liveTrack: LiveTrack;
  private readonly frames: LiveFrame[] = [];
  /** Age of the poses that arrived. */
  readonly latency = new LiveLatency();

  /** @param track motion track of the performer */
  constructor(track: MotionTrack) {
    this.liveTrack = new LiveTrack(track);
  }

  /** Number of poses held. */
  get length(): number {
    return this.frames.length;
  }

  /**
   * Add the poses of a block of `frames` frames, the last due at `due`, that arrived at local `nowMs`. A pose for a
   * time that is held is ignored.
   *
   * @throws DamagedBlock
   */
  put(due: number, frames: number, { ageUs, data }: LiveBlock, nowMs = 0): void {
    const block = this.liveTrack.decode(frames, data);
    this.latency.add(ageUs, nowMs);
    for (let nth = 0; nth < frames; nth++) {
      const frame = this.insert(due - (frames - 1 - nth) * LIVE_FRAME_INTERVAL_US);
      if (frame) block.poseAt(nth, frame.pose);
    }
  }

  /**
   * Write the pose at `clock` to `out`. Return false, and leave `out` unchanged, before the first pose and after the
   * last one has held.
   */
  poseAt(clock: number, out: Pose): boolean {
    const { frames } = this;
    let at = frames.length;
    while (at > 0 && frames[at - 1].due > clock) at--;
    if (at === 0 || clock - frames[at - 1].due > LIVE_HOLD_US) return false;
    const before = frames[at - 1];
    copyPose(before.pose, out);
    // after a gap a pose takes effect when it is due
    if (at === frames.length || frames[at].due - before.due > LIVE_HOLD_US) return true;
    const { due, pose: next } = frames[at];
    const mix = (clock - before.due) / (due - before.due);
    for (let axis = 0; axis < 3; axis++) out.root[axis] += mix * (next.root[axis] - out.root[axis]);
    for (let joint = 0; joint < JOINT_COUNT * 4; joint += 4)
      slerp(out.rotations, joint, out.rotations, joint, next.rotations, joint, mix);
    return true;
  }

  /** Return a new frame at its place, or null if one with this due time is held, or if all held ones are later. */
  private insert(due: number): LiveFrame | null {
    const { frames } = this;
    let at = frames.length;
    while (at > 0 && frames[at - 1].due >= due) at--;
    if (frames[at]?.due === due) return null;
    if (frames.length < MAX_FRAMES) {
      const frame = { due, pose: restPose() };
      frames.splice(at, 0, frame);
      return frame;
    }
    if (at === 0) return null;
    // the oldest frame's storage is used again
    const frame = frames.shift()!;
    frame.due = due;
    frames.splice(at - 1, 0, frame);
    return frame;
  }
}
