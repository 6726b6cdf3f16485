/**
 * The plane an arm hangs in, with memory: it is carried along with the hand by the shortest turn, and swings about the
 * line from shoulder to tip towards the vertical, the faster the farther the hand is from the vertical axis. So an elbow
 * does not pop across as the hand passes under the shoulder, and the tip stays in the plane. As `marionette/plane.py`.
 */

import { rotate, type Numbers } from "../motion/rotation";
import { across, between, cross, dot, length, squareTo, unit } from "../motion/vector";

/** Distance from the vertical axis, in arm lengths, at which the plane is drawn half as fast as far away. */
const NEAR_AXIS = 0.05;
/** Seconds in which the swing left to do halves, far from the axis. */
const HALF_LIFE = 0.08;
/** Radians per second that the plane swings at most. */
const FASTEST = 2 * Math.PI;

/** Normal (3) of the vertical plane through the unit `direction`; false, nothing written, within 1e-9 of the axis. */
export function verticalNormal(
  out: Numbers, outAt: number, direction: Numbers, directionAt: number, up: Numbers, upAt: number,
): boolean {
  const x = out[outAt], y = out[outAt + 1], z = out[outAt + 2];
  cross(out, outAt, direction, directionAt, up, upAt);
  if (unit(out, outAt, out, outAt, 1e-9)) return true;
  out[outAt] = x;
  out[outAt + 1] = y;
  out[outAt + 2] = z;
  return false;
}

/** One arm's plane, in the shoulder's frame so that a turning body carries it. */
export class Plane {
  /** Its unit normal: turning about it lifts the outer end of a link. */
  readonly normal = new Float64Array(3);
  private readonly direction = new Float64Array(3);
  private readonly wanted = new Float64Array(3);
  private readonly side = new Float64Array(3);
  private readonly turn = new Float64Array(4);

  /** Starts square to the unit `direction` of the hand tip, as near to `normal` as that allows. */
  start(normal: Numbers, direction: Numbers): void {
    this.direction.set(direction);
    squareTo(this.normal, 0, normal, 0, direction, 0);
    if (!unit(this.normal, 0, this.normal, 0)) across(this.normal, 0, direction, 0);
  }

  /** The tip has come to the unit `direction` at `reach` arm lengths, `seconds` after the last; `up` is the world's. */
  follow(direction: Numbers, reach: number, up: Numbers, seconds: number): void {
    const { normal, wanted, side, turn } = this;
    between(turn, 0, this.direction, 0, direction, 0);
    rotate(normal, 0, turn, 0, normal, 0);
    squareTo(normal, 0, normal, 0, direction, 0);
    if (!unit(normal, 0, normal, 0)) across(normal, 0, direction, 0);
    this.direction.set(direction);
    if (!verticalNormal(wanted, 0, direction, 0, up, 0)) return;
    squareTo(side, 0, direction, 0, up, 0);
    const off = length(side, 0) * reach;
    const pull = (off * off) / (off * off + NEAR_AXIS * NEAR_AXIS);
    cross(side, 0, normal, 0, wanted, 0);
    const swing = Math.atan2(dot(side, 0, direction, 0), dot(normal, 0, wanted, 0));
    const most = FASTEST * seconds;
    const angle = Math.min(Math.max(swing * (1 - 2 ** ((-seconds * pull) / HALF_LIFE)), -most), most);
    cross(side, 0, direction, 0, normal, 0);
    const c = Math.cos(angle), s = Math.sin(angle);
    for (let i = 0; i < 3; i++) normal[i] = normal[i] * c + side[i] * s;
  }
}
