/**
 * Correction of the legs of a drawn figure, so that planted feet stay where they were put (`proto/playback.md`, 4.11).
 * Other limb lengths than those of the performer, or a base that was moved, would let them slide.
 *
 * A foot that is put down is held at the place where it is drawn then; when it is lifted, the distance to the pose's
 * own place fades. So the feet are where the pose has them whenever a contact begins, and nothing jumps. If a leg is
 * too short, the whole figure is lowered. Loaded when the first pose has contacts.
 */
import { type Object3D, Quaternion, Vector3 } from "three";
import type { FootContacts } from "../../motion/foot-contact";
import { type Leg, MAX_STRETCH, turnLeg, worldRotation } from "./leg-turn";

/** Leg with the ball of its foot, in the frame of the ankle's node. */
export interface FootedLeg extends Leg {
  readonly ball: Vector3;
}

/** Time in which the correction of a lifted foot fades, seconds. */
const FADE_S = 0.2;
/** Longest time step, seconds: a longer pause between two frames counts as this. */
const MAX_STEP_S = 0.1;
/** Movement of a planted foot in the pose beyond which the motion was sought, in legs and in legs per second. */
const SEEK_SHARE = 0.05;
const SEEK_SPEED = 3;
/** Longest correction of a foot, and largest lowering of the figure, as shares of the leg. */
const MAX_OFFSET_SHARE = 0.4;
const MAX_DROP_SHARE = 0.12;
/** Change of height, as a share of the leg, that a planted foot has in the pose itself: it rolls. */
const MAX_SINK_SHARE = 0.02;
const MAX_RISE_SHARE = 0.04;
/** Corrections below this are not drawn, as a share of the leg. */
const MIN_OFFSET_SHARE = 1e-5;

/** State and places of one foot. */
class Foot {
  isPlanted = false;
  /** Correction of the foot, and where it was when the foot was lifted, metres in the world frame. */
  readonly offset = new Vector3();
  readonly released = new Vector3();
  /** Time for which the correction still fades, seconds. */
  fadeS = 0;
  /** Place of the ball while it is planted, and in the last pose. */
  readonly anchor = new Vector3();
  readonly last = new Vector3();
  readonly ball = new Vector3();
  readonly hip = new Vector3();
  readonly ankle = new Vector3();
  readonly target = new Vector3();
  length = 0;

  constructor(readonly leg: FootedLeg) {}

  /** Take the places of the pose. */
  observe(): void {
    const { hip, knee, ankle, ball } = this.leg;
    this.hip.setFromMatrixPosition(hip.matrixWorld);
    this.ankle.setFromMatrixPosition(ankle.matrixWorld);
    this.ball.copy(ball).applyMatrix4(ankle.matrixWorld);
    scratch.setFromMatrixPosition(knee.matrixWorld);
    this.length = this.hip.distanceTo(scratch) + scratch.distanceTo(this.ankle);
  }

  /** Update the correction for `seconds` since the last pose. */
  advance(isPlanted: boolean, seconds: number): void {
    const { anchor, ball, last, length, offset, released } = this;
    if (this.isPlanted && last.distanceTo(ball) > (SEEK_SHARE + SEEK_SPEED * seconds) * length) this.reset();
    last.copy(ball);
    if (isPlanted) {
      if (!this.isPlanted) anchor.copy(ball).add(offset);
      offset.copy(anchor).sub(ball);
      // it rolls within these heights
      offset.y = Math.max(offset.y - MAX_SINK_SHARE * length, 0) + Math.min(offset.y + MAX_RISE_SHARE * length, 0);
      if (offset.length() > MAX_OFFSET_SHARE * length) {
        offset.setLength(MAX_OFFSET_SHARE * length);
        anchor.copy(ball).add(offset);
      }
    } else {
      if (this.isPlanted) {
        released.copy(offset);
        this.fadeS = FADE_S;
      }
      this.fadeS = Math.max(this.fadeS - seconds, 0);
      const share = this.fadeS / FADE_S;
      offset.copy(released).multiplyScalar(share * share * (3 - 2 * share));
    }
    this.isPlanted = isPlanted;
  }

  reset(): void {
    this.isPlanted = false;
    this.offset.set(0, 0, 0);
    this.released.set(0, 0, 0);
    this.fadeS = 0;
  }

  /** Return how far the hip is to be lowered so that the leg reaches its target, metres. */
  requiredDrop(): number {
    const { hip, ankle, target, length } = this;
    const reach = Math.max(MAX_STRETCH * length, hip.distanceTo(ankle));
    const { x, y, z } = scratch.copy(hip).sub(target);
    return Math.max(y - Math.sqrt(Math.max(reach * reach - x * x - z * z, 0)), 0);
  }
}

export class PlantedFeet {
  readonly #feet: readonly Foot[];
  #clock = 0;

  /**
   * @param base node that carries the whole figure
   * @param legs left and right leg
   */
  constructor(
    private readonly base: Object3D,
    legs: readonly FootedLeg[],
  ) {
    this.#feet = legs.map((leg) => new Foot(leg));
  }

  /** Return the corrections of the feet, metres in the world frame. */
  get offsets(): readonly Vector3[] {
    return this.#feet.map(({ offset }) => offset);
  }

  /** Correct the figure, which is in its pose with world matrices up to date; null if contacts are not known. */
  apply(contacts: FootContacts | null): void {
    const feet = this.#feet;
    if (!contacts) {
      for (const foot of feet) foot.reset();
      return;
    }
    const seconds = Math.min(Math.max(contacts.clock - this.#clock, 0) / 1e6, MAX_STEP_S);
    this.#clock = contacts.clock;
    let isMoved = false;
    let drop = 0;
    feet.forEach((foot, side) => {
      foot.observe();
      foot.advance(((contacts.planted >> side) & 1) !== 0, seconds);
      foot.target.copy(foot.ankle).add(foot.offset);
      if (foot.offset.length() < MIN_OFFSET_SHARE * foot.length) return;
      isMoved = true;
      drop = Math.max(drop, Math.min(foot.requiredDrop(), MAX_DROP_SHARE * foot.length));
    });
    if (!isMoved) return;
    if (drop > 0) this.#lower(drop);
    feet.forEach((foot, side) => {
      const isControlled = ((contacts.controlled >> side) & 1) !== 0;
      const moved = foot.offset.length() + (isControlled ? 0 : drop);
      if (moved >= MIN_OFFSET_SHARE * foot.length) turnLeg(foot.leg, foot.target, moved);
    });
  }

  /** Lower the base by `drop` metres in the world frame. */
  #lower(drop: number): void {
    const { base } = this;
    scratch.set(0, -drop, 0);
    if (base.parent) scratch.applyQuaternion(worldRotation(base.parent, rotation).invert());
    base.position.add(scratch);
    base.updateMatrixWorld(true);
  }
}

const scratch = new Vector3();
const rotation = new Quaternion();
