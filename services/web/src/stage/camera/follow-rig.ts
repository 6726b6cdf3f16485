/**
 * Rig that carries camera, lights, backdrop and floor along with the performers, so that joints stay where the motion
 * puts them. Motion capture walks off, faces any direction and stands on a floor a few centimetres from zero: the rig
 * follows position, facing and height smoothly.
 */
import { Box3, Group, type Matrix4, Quaternion, Vector2, Vector3 } from "three";
import type { Performer } from "../puppet/performer";

/** Distance from the rig's centre at which it starts to follow, in metres, and its rate in 1/s. */
const FOLLOW_DISTANCE_M = 0.25;
const FOLLOW_RATE = 2.5;
/** A performer further away than this was moved by a seek or a new motion: cut instead of travelling. */
const CUT_DISTANCE_M = 1.2;
/**
 * Facing is averaged over this time, and followed only beyond this angle and after a minimum time: a pirouette does not
 * turn the stage, nor does a performer who enters with the back turned. The motion itself says where its front is.
 */
const FACING_WINDOW_S = 8;
const FACING_TOLERANCE_RAD = Math.PI / 3;
const MIN_FACING_TIME_S = 2.5;
const TURN_RATE = 0.8;
/**
 * Rates at which the floor sinks to a foot below it and rises to feet above it, in 1/s: slow enough that a foot that
 * dips briefly at a low bitrate does not move it. The floor does not rise to a jump, in metres.
 */
const SINK_RATE = 2.5;
const RISE_RATE = 0.6;
const JUMP_HEIGHT_M = 0.15;

export class FollowRig {
  readonly group = new Group();
  /** Distance travelled in x and z, in units of the floor: the boards stay in place while the rig moves. */
  readonly floorOffset = new Vector2();
  /** Width of the scenery as a multiple of what one performer needs. */
  widthScale = 1;
  readonly #facing = new Vector2();
  #initialFacing = 0;
  #facingTimeS = 0;
  #isPlaced = false;

  constructor() {
    this.group.name = "rig";
  }

  /** Cut to the next performer. `front` is the mean facing of the motion, in radians about y from z towards x. */
  reset(front = 0): void {
    this.#isPlaced = false;
    this.#initialFacing = front;
  }

  /** Advance by `seconds`, following these performers (at least one). */
  follow(performers: readonly Pick<Performer, "root" | "ground">[], seconds: number): void {
    const { position, rotation } = this.group;
    const centre = new Box3()
      .setFromPoints(performers.map((performer) => new Vector3().setFromMatrixPosition(performer.root)))
      .getCenter(new Vector3());
    const facing = performers
      .reduce((sum, performer) => sum.add(facingOf(performer.root)), new Vector2())
      .divideScalar(performers.length);
    const ground = Math.min(...performers.map((performer) => performer.ground));
    const distance = Math.hypot(centre.x - position.x, centre.z - position.z);
    if (!this.#isPlaced || distance > CUT_DISTANCE_M) {
      if (!this.#isPlaced) {
        position.y = ground;
        this.#facing.set(Math.sin(this.#initialFacing), Math.cos(this.#initialFacing));
        this.#facingTimeS = MIN_FACING_TIME_S;
        rotation.y = this.#initialFacing;
      }
      this.#isPlaced = true;
      position.set(centre.x, position.y, centre.z);
      return;
    }
    // Arithmetic mean at first, then an exponential one.
    this.#facingTimeS += seconds;
    this.#facing.lerp(facing, seconds / Math.min(Math.max(this.#facingTimeS, seconds, 1e-3), FACING_WINDOW_S));
    const turn = Math.atan2(this.#facing.x, this.#facing.y) - rotation.y;
    const facingError = Math.atan2(Math.sin(turn), Math.cos(turn));
    // A performer who keeps turning has no front: the mean is short, and the stage does not turn.
    if (this.#facingTimeS > MIN_FACING_TIME_S && this.#facing.length() > 0.5) {
      const excess = Math.sign(facingError) * Math.max(0, Math.abs(facingError) - FACING_TOLERANCE_RAD);
      rotation.y += excess * (1 - Math.exp(-TURN_RATE * seconds));
    }

    const lift = ground - position.y;
    if (lift < 0) position.y += lift * (1 - Math.exp(-SINK_RATE * seconds));
    else if (lift < JUMP_HEIGHT_M) position.y += lift * (1 - Math.exp(-RISE_RATE * seconds));
    if (distance > FOLLOW_DISTANCE_M) {
      const share = ((distance - FOLLOW_DISTANCE_M) / distance) * (1 - Math.exp(-FOLLOW_RATE * seconds));
      const step = new Vector3((centre.x - position.x) * share, 0, (centre.z - position.z) * share);
      position.add(step);
      step.applyAxisAngle(new Vector3(0, 1, 0), -rotation.y);
      this.floorOffset.add(new Vector2(step.x, step.z).divideScalar(this.widthScale));
    }
  }
}

/** Return the direction of the pelvis on the floor as (x, z). */
function facingOf(centre: Matrix4): Vector2 {
  const forward = new Vector3(0, 0, 1).applyQuaternion(new Quaternion().setFromRotationMatrix(centre));
  const flat = new Vector2(forward.x, forward.z);
  return flat.lengthSq() > 1e-4 ? flat.normalize() : flat.set(0, 1);
}
