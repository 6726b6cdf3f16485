/** Pulled limbs laid over the dance, interpolated on clock time (`proto/SPEC.md`, Overlay). */

import { fromRotationVector, slerp } from "../motion/rotation";
import { LIMB_FIRST_JOINTS, LIMBS, type Pose } from "../motion/skeleton";
import { limbNumber } from "../wire/limbs";
import { OVERLAY_FRAME_INTERVAL_US, type Overlay } from "../wire/overlay";

/** With no overlay for so long, microseconds, the dance is alone. */
export const OVERLAY_HOLD_US = 250_000;

/** More than are ever due at once: two seconds at 60 Hz. */
const MAX_FRAMES = 120;

const RADIANS_PER_UNIT = Math.PI / 32767;

/** Numbers of one limb: three quaternions. */
const NUMBERS_PER_LIMB = 12;

/** The bits of one performer's limbs. */
const LIMBS_MASK = (1 << LIMBS.length) - 1;

interface OverlayFrame {
  due: number;
  mask: number;
  /** For each limb up to the last pulled one its three joints' local rotations, w x y z (12). */
  rotations: Float64Array;
}

function decodeFrame(limbs: Overlay["limbs"], due: number): OverlayFrame {
  const laid = { due, mask: 0, rotations: new Float64Array((1 + Math.max(-1, ...limbs.keys())) * NUMBERS_PER_LIMB) };
  for (const [limb, numbers] of limbs) {
    laid.mask |= 1 << limb;
    for (let joint = 0; joint < 3; joint++) {
      const [x, y, z] = [0, 1, 2].map((axis) => numbers[joint * 3 + axis] * RADIANS_PER_UNIT);
      fromRotationVector(laid.rotations, limb * NUMBERS_PER_LIMB + joint * 4, x, y, z);
    }
  }
  return laid;
}

/** The overlays of the last moments, in the order in which they are due. */
export class OverlayBuffer {
  private frames: OverlayFrame[] = [];

  /** Takes in an overlay, late or not, frame by frame; a second frame for the same time replaces the first. */
  put({ due, limbs, earlier }: Overlay): void {
    earlier.forEach((frame, nth) =>
      this.insert(decodeFrame(frame, due - (earlier.length - nth) * OVERLAY_FRAME_INTERVAL_US)),
    );
    this.insert(decodeFrame(limbs, due));
  }

  /** Forgets all: the stage shows another motion. */
  clear(): void {
    this.frames = [];
  }

  /**
   * Lays the limbs of `performer` pulled at `clock` over its `pose`; the mask of those laid, bit 0 the first of its four.
   *
   * Between two overlays a limb goes from the one before to the one after, or from the dance where the one before leaves it to
   * the dance. With none after, or none before, the nearest holds for `SILENCE` at most.
   */
  apply(clock: number, pose: Pose, performer = 0): number {
    const { frames: laid } = this;
    let at = laid.length;
    while (at > 0 && laid[at - 1].due > clock) at--;
    const before = at > 0 && clock - laid[at - 1].due < OVERLAY_HOLD_US ? laid[at - 1] : null;
    const after = at < laid.length ? laid[at] : null;
    // the first after a silence begins when it is due
    const goal = after && before && after.due - before.due < OVERLAY_HOLD_US ? after : before;
    if (!before || !goal) return 0;
    const mix = goal === before ? 1 : (clock - before.due) / (goal.due - before.due);
    for (let limb = 0; limb < LIMBS.length; limb++) {
      const number = limbNumber(performer, limb);
      if (!((goal.mask >> number) & 1)) continue;
      const held = (before.mask >> number) & 1;
      for (let joint = 0; joint < 3; joint++) {
        const from = number * NUMBERS_PER_LIMB + joint * 4;
        const to = (LIMB_FIRST_JOINTS[limb] + joint) * 4;
        if (held) slerp(pose.rotations, to, before.rotations, from, goal.rotations, from, mix);
        else slerp(pose.rotations, to, pose.rotations, to, goal.rotations, from, mix);
      }
    }
    return (goal.mask >> limbNumber(performer, 0)) & LIMBS_MASK;
  }

  private insert(frame: OverlayFrame): void {
    const { frames: laid } = this;
    let at = laid.length;
    while (at > 0 && laid[at - 1].due >= frame.due) at--;
    laid.splice(at, laid[at]?.due === frame.due ? 1 : 0, frame);
    if (laid.length > MAX_FRAMES) laid.shift();
  }
}
