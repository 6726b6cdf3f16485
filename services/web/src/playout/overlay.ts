/** Pulled limbs laid over the dance, interpolated on clock time (`proto/SPEC.md`, Overlay). */

import { fromRotationVector, slerp } from "../motion/rotation";
import { LIMB_JOINTS, LIMBS, type Pose } from "../motion/skeleton";
import { limbNumber } from "../wire/limbs";
import { OVERLAY_FRAME, type Overlay } from "../wire/overlay";

/** With no overlay for so long, microseconds, the dance is alone. */
export const SILENCE = 250_000;

/** More than are ever due at once: two seconds at 60 Hz. */
const MOST = 120;

const UNIT = Math.PI / 32767;

/** Numbers of one limb: three quaternions. */
const LIMB_SIZE = 12;

/** The bits of one performer's limbs. */
const LIMBS_MASK = (1 << LIMBS.length) - 1;

interface Laid {
  due: number;
  mask: number;
  /** For each limb up to the last pulled one its three joints' local rotations, w x y z (12). */
  rotations: Float64Array;
}

function read(limbs: Overlay["limbs"], due: number): Laid {
  const laid = { due, mask: 0, rotations: new Float64Array((1 + Math.max(-1, ...limbs.keys())) * LIMB_SIZE) };
  for (const [limb, numbers] of limbs) {
    laid.mask |= 1 << limb;
    for (let joint = 0; joint < 3; joint++) {
      const [x, y, z] = [0, 1, 2].map((axis) => numbers[joint * 3 + axis] * UNIT);
      fromRotationVector(laid.rotations, limb * LIMB_SIZE + joint * 4, x, y, z);
    }
  }
  return laid;
}

/** The overlays of the last moments, in the order in which they are due. */
export class Overlays {
  private laid: Laid[] = [];

  /** Takes in an overlay, late or not, frame by frame; a second frame for the same time replaces the first. */
  put({ due, limbs, earlier }: Overlay): void {
    earlier.forEach((frame, nth) => this.insert(read(frame, due - (earlier.length - nth) * OVERLAY_FRAME)));
    this.insert(read(limbs, due));
  }

  /** Forgets all: the stage shows another motion. */
  clear(): void {
    this.laid = [];
  }

  /**
   * Lays the limbs of `performer` pulled at `clock` over its `pose`; the mask of those laid, bit 0 the first of its four.
   *
   * Between two overlays a limb goes from the one before to the one after, or from the dance where the one before leaves it to
   * the dance. With none after, or none before, the nearest holds for `SILENCE` at most.
   */
  lay(clock: number, pose: Pose, performer = 0): number {
    const { laid } = this;
    let at = laid.length;
    while (at > 0 && laid[at - 1].due > clock) at--;
    const before = at > 0 && clock - laid[at - 1].due < SILENCE ? laid[at - 1] : null;
    const after = at < laid.length ? laid[at] : null;
    // the first after a silence begins when it is due
    const goal = after && before && after.due - before.due < SILENCE ? after : before;
    if (!before || !goal) return 0;
    const mix = goal === before ? 1 : (clock - before.due) / (goal.due - before.due);
    for (let limb = 0; limb < LIMBS.length; limb++) {
      const number = limbNumber(performer, limb);
      if (!((goal.mask >> number) & 1)) continue;
      const held = (before.mask >> number) & 1;
      for (let joint = 0; joint < 3; joint++) {
        const from = number * LIMB_SIZE + joint * 4;
        const to = (LIMB_JOINTS[limb] + joint) * 4;
        if (held) slerp(pose.rotations, to, before.rotations, from, goal.rotations, from, mix);
        else slerp(pose.rotations, to, pose.rotations, to, goal.rotations, from, mix);
      }
    }
    return (goal.mask >> limbNumber(performer, 0)) & LIMBS_MASK;
  }

  private insert(frame: Laid): void {
    const { laid } = this;
    let at = laid.length;
    while (at > 0 && laid[at - 1].due >= frame.due) at--;
    laid.splice(at, laid[at]?.due === frame.due ? 1 : 0, frame);
    if (laid.length > MOST) laid.shift();
  }
}
