/**
 * The rig carries camera, lights, backdrop and floor after the dancer, of several after the middle between them, so that joints stay where the dance puts them. Mocap
 * walks off, faces anywhere and stands on a floor a few centimetres from zero: the rig takes all three up, calmly.
 */
import { Box3, Group, type Matrix4, Quaternion, Vector2, Vector3 } from "three";
import type { Performer } from "../puppet/performer";

/** The rig follows once the dancer is this far from its middle, metres, and this quickly, 1/s. */
const FOLLOW_DISTANCE_M = 0.25;
const FOLLOW_RATE = 2.5;
/** A dancer further away than this was put there by a seek or a new motion: cut, do not travel. */
const CUT_DISTANCE_M = 1.2;
/**
 * Facing is averaged over so many seconds, and followed only beyond this angle and once watched for a while: a pirouette
 * turns no stage, nor does a back that is turned as one comes in: the dance itself says where its front is.
 */
const FACING_WINDOW_S = 8;
const FACING_TOLERANCE_RAD = Math.PI / 3;
const MIN_FACING_TIME_S = 2.5;
const TURN_RATE = 0.8;
/**
 * The floor sinks to a foot below it and rises to feet above it, 1/s: slowly enough that a foot that dips for a moment at a
 * low rate takes it nowhere, and never to a jump, metres.
 */
const SINK_RATE = 2.5;
const RISE_RATE = 0.6;
const JUMP_HEIGHT_M = 0.15;

export class FollowRig {
  readonly group = new Group();
  /** What the rig has gone in x and z, in the measures of the floor: its boards stay while it moves. */
  readonly floorOffset = new Vector2();
  /** How many times wider than for one dancer what stands about them is. */
  widthScale = 1;
  readonly #facing = new Vector2();
  #initialFacing = 0;
  #facingTimeS = 0;
  #isPlaced = false;

  constructor() {
    this.group.name = "rig";
  }

  /** The next dancer is met with a cut, from where the dance faces over its length (radians about y from z towards x). */
  reset(front = 0): void {
    this.#isPlaced = false;
    this.#initialFacing = front;
  }

  /** Moves on by `seconds` after these dancers, one at least. */
  follow(performers: readonly Pick<Performer, "root" | "ground">[], seconds: number): void {
    const { position, rotation } = this.group;
    const root = new Box3()
      .setFromPoints(performers.map((dancer) => new Vector3().setFromMatrixPosition(dancer.root)))
      .getCenter(new Vector3());
    const facing = performers
      .reduce((sum, dancer) => sum.add(facingOf(dancer.root)), new Vector2())
      .divideScalar(performers.length);
    const ground = Math.min(...performers.map((dancer) => dancer.ground));
    const away = Math.hypot(root.x - position.x, root.z - position.z);
    if (!this.#isPlaced || away > CUT_DISTANCE_M) {
      if (!this.#isPlaced) {
        position.y = ground;
        this.#facing.set(Math.sin(this.#initialFacing), Math.cos(this.#initialFacing));
        this.#facingTimeS = MIN_FACING_TIME_S;
        rotation.y = this.#initialFacing;
      }
      this.#isPlaced = true;
      position.set(root.x, position.y, root.z);
      return;
    }
    // A plain mean at first, then a fading one.
    this.#facingTimeS += seconds;
    this.#facing.lerp(facing, seconds / Math.min(Math.max(this.#facingTimeS, seconds, 1e-3), FACING_WINDOW_S));
    const turn = Math.atan2(this.#facing.x, this.#facing.y) - rotation.y;
    const off = Math.atan2(Math.sin(turn), Math.cos(turn));
    // A dancer who turns about has no one front: the mean is then short, and the stage stays as it is.
    if (this.#facingTimeS > MIN_FACING_TIME_S && this.#facing.length() > 0.5) {
      const beyond = Math.sign(off) * Math.max(0, Math.abs(off) - FACING_TOLERANCE_RAD);
      rotation.y += beyond * (1 - Math.exp(-TURN_RATE * seconds));
    }

    const lift = ground - position.y;
    if (lift < 0) position.y += lift * (1 - Math.exp(-SINK_RATE * seconds));
    else if (lift < JUMP_HEIGHT_M) position.y += lift * (1 - Math.exp(-RISE_RATE * seconds));
    if (away > FOLLOW_DISTANCE_M) {
      const share = ((away - FOLLOW_DISTANCE_M) / away) * (1 - Math.exp(-FOLLOW_RATE * seconds));
      const step = new Vector3((root.x - position.x) * share, 0, (root.z - position.z) * share);
      position.add(step);
      step.applyAxisAngle(new Vector3(0, 1, 0), -rotation.y);
      this.floorOffset.add(new Vector2(step.x, step.z).divideScalar(this.widthScale));
    }
  }
}

/** Where the pelvis faces on the floor, as (x, z). */
function facingOf(root: Matrix4): Vector2 {
  const forward = new Vector3(0, 0, 1).applyQuaternion(new Quaternion().setFromRotationMatrix(root));
  const flat = new Vector2(forward.x, forward.z);
  return flat.lengthSq() > 1e-4 ? flat.normalize() : flat.set(0, 1);
}
