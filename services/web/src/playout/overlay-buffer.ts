/** Overlays of controlled limbs, applied to the motion's pose at any clock time (`proto/messages.md`, 3.5). */

import { fromRotationVector, slerp } from "../motion/rotation";
import { LIMB_FIRST_JOINTS, LIMBS, type Pose } from "../motion/skeleton";
import { limbNumber } from "../wire/limbs";
import { OVERLAY_FRAME_INTERVAL_US, type Overlay } from "../wire/overlay";

/** Time for which the last overlay holds, microseconds. */
export const OVERLAY_HOLD_US = 250_000;

/** Capacity of the buffer: two seconds at 60 Hz, more than are pending at once. */
const MAX_FRAMES = 120;

/** Resolution of an overlay's rotation vectors. */
const RADIANS_PER_UNIT = Math.PI / 32767;

/** Numbers of one limb: three quaternions. */
const NUMBERS_PER_LIMB = 12;

/** Mask of one performer's limbs. */
const LIMBS_MASK = (1 << LIMBS.length) - 1;

interface OverlayFrame {
  due: number;
  mask: number;
  /** Local rotations (w x y z) of three joints for each limb, up to the last controlled one. */
  rotations: Float64Array;
}

function decodeFrame(limbs: Overlay["limbs"], due: number): OverlayFrame {
  const rotations = new Float64Array((1 + Math.max(-1, ...limbs.keys())) * NUMBERS_PER_LIMB);
  let mask = 0;
  for (const [limb, numbers] of limbs) {
    mask |= 1 << limb;
    for (let joint = 0; joint < 3; joint++) {
      const [x, y, z] = [0, 1, 2].map((axis) => numbers[joint * 3 + axis] * RADIANS_PER_UNIT);
      fromRotationVector(rotations, limb * NUMBERS_PER_LIMB + joint * 4, x, y, z);
    }
  }
  return { due, mask, rotations };
}

/** Last overlays, in order of their due times. */
export class OverlayBuffer {
  private frames: OverlayFrame[] = [];

  /** Add the frames of an overlay, in any order of arrival; a frame replaces an earlier one with the same due time. */
  put({ due, limbs, earlier }: Overlay): void {
    earlier.forEach((frame, nth) =>
      this.insert(decodeFrame(frame, due - (earlier.length - nth) * OVERLAY_FRAME_INTERVAL_US)),
    );
    this.insert(decodeFrame(limbs, due));
  }

  /** Discard all overlays, since the motion changed. */
  clear(): void {
    this.frames = [];
  }

  /**
   * Replace the limbs of `performer` that are controlled at `clock` in its `pose`. Return their mask; bit 0 is the
   * first of its four limbs.
   *
   * Between two overlays the later one determines which limbs are controlled; a limb that is new in it is blended in
   * from the motion. The last overlay holds for `OVERLAY_HOLD_US`.
   */
  apply(clock: number, pose: Pose, performer = 0): number {
    const { frames } = this;
    let at = frames.length;
    while (at > 0 && frames[at - 1].due > clock) at--;
    const before = at > 0 && clock - frames[at - 1].due < OVERLAY_HOLD_US ? frames[at - 1] : null;
    if (!before) return 0;
    // after a gap an overlay takes effect when it is due
    const after = at < frames.length && frames[at].due - before.due < OVERLAY_HOLD_US ? frames[at] : null;
    const target = after ?? before;
    const mix = after ? (clock - before.due) / (after.due - before.due) : 1;
    for (let limb = 0; limb < LIMBS.length; limb++) {
      const number = limbNumber(performer, limb);
      if (!((target.mask >> number) & 1)) continue;
      const isContinued = (before.mask >> number) & 1;
      for (let joint = 0; joint < 3; joint++) {
        const from = number * NUMBERS_PER_LIMB + joint * 4;
        const to = (LIMB_FIRST_JOINTS[limb] + joint) * 4;
        if (isContinued) slerp(pose.rotations, to, before.rotations, from, target.rotations, from, mix);
        else slerp(pose.rotations, to, pose.rotations, to, target.rotations, from, mix);
      }
    }
    return (target.mask >> limbNumber(performer, 0)) & LIMBS_MASK;
  }

  private insert(frame: OverlayFrame): void {
    const { frames } = this;
    let at = frames.length;
    while (at > 0 && frames[at - 1].due >= frame.due) at--;
    frames.splice(at, frames[at]?.due === frame.due ? 1 : 0, frame);
    if (frames.length > MAX_FRAMES) frames.shift();
  }
}
