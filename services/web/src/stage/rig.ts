/**
 * The rig carries camera, lights, backdrop and floor after the dancer, of several after the middle between them, so that joints stay where the dance puts them. Mocap
 * walks off, faces anywhere and stands on a floor a few centimetres from zero: the rig takes all three up, calmly.
 */
import { Box3, Group, Matrix4, Quaternion, Vector2, Vector3 } from "three";
import type { Performer } from "./performer";

/** The rig follows once the dancer is this far from its middle, metres, and this quickly, 1/s. */
const LEASH = 0.25;
const FOLLOW = 2.5;
/** A dancer further away than this was put there by a seek or a new motion: cut, do not travel. */
const CUT = 1.2;
/**
 * Facing is averaged over so many seconds, and followed only beyond this angle and once watched for a while: a pirouette
 * turns no stage, nor does a back that is turned as one comes in: the dance itself says where its front is.
 */
const FACING_MEMORY = 8;
const FACING_SLACK = Math.PI / 3;
const WATCHED = 2.5;
const TURN = 0.8;
/**
 * The floor sinks to a foot below it and rises to feet above it, 1/s: slowly enough that a foot that dips for a moment at a
 * low rate takes it nowhere, and never to a jump, metres.
 */
const SINK = 2.5;
const RISE = 0.6;
const JUMP = 0.15;

export class Rig {
  readonly group = new Group();
  /** What the rig has gone in x and z, in the measures of the floor: its boards stay while it moves. */
  readonly travelled = new Vector2();
  /** How many times wider than for one dancer what stands about them is. */
  wide = 1;
  readonly #facing = new Vector2();
  #front = 0;
  #watched = 0;
  #placed = false;

  constructor() {
    this.group.name = "rig";
  }

  /** The next dancer is met with a cut, from where the dance faces over its length (radians about y from z towards x). */
  reset(front = 0): void {
    this.#placed = false;
    this.#front = front;
  }

  /** Moves on by `seconds` after these dancers, one at least. */
  follow(dancers: readonly Pick<Performer, "root" | "ground">[], seconds: number): void {
    const { position, rotation } = this.group;
    const root = new Box3().setFromPoints(dancers.map((dancer) => new Vector3().setFromMatrixPosition(dancer.root))).getCenter(new Vector3());
    const facing = dancers.reduce((sum, dancer) => sum.add(facingOf(dancer.root)), new Vector2()).divideScalar(dancers.length);
    const ground = Math.min(...dancers.map((dancer) => dancer.ground));
    const away = Math.hypot(root.x - position.x, root.z - position.z);
    if (!this.#placed || away > CUT) {
      if (!this.#placed) {
        position.y = ground;
        this.#facing.set(Math.sin(this.#front), Math.cos(this.#front));
        this.#watched = WATCHED;
        rotation.y = this.#front;
      }
      this.#placed = true;
      position.set(root.x, position.y, root.z);
      return;
    }
    // A plain mean at first, then a fading one.
    this.#watched += seconds;
    this.#facing.lerp(facing, seconds / Math.min(Math.max(this.#watched, seconds, 1e-3), FACING_MEMORY));
    const turn = Math.atan2(this.#facing.x, this.#facing.y) - rotation.y;
    const off = Math.atan2(Math.sin(turn), Math.cos(turn));
    // A dancer who turns about has no one front: the mean is then short, and the stage stays as it is.
    if (this.#watched > WATCHED && this.#facing.length() > 0.5) {
      const beyond = Math.sign(off) * Math.max(0, Math.abs(off) - FACING_SLACK);
      rotation.y += beyond * (1 - Math.exp(-TURN * seconds));
    }

    const lift = ground - position.y;
    if (lift < 0) position.y += lift * (1 - Math.exp(-SINK * seconds));
    else if (lift < JUMP) position.y += lift * (1 - Math.exp(-RISE * seconds));
    if (away > LEASH) {
      const share = ((away - LEASH) / away) * (1 - Math.exp(-FOLLOW * seconds));
      const step = new Vector3((root.x - position.x) * share, 0, (root.z - position.z) * share);
      position.add(step);
      step.applyAxisAngle(new Vector3(0, 1, 0), -rotation.y);
      this.travelled.add(new Vector2(step.x, step.z).divideScalar(this.wide));
    }
  }
}

/** Where the pelvis faces on the floor, as (x, z). */
function facingOf(root: Matrix4): Vector2 {
  const forward = new Vector3(0, 0, 1).applyQuaternion(new Quaternion().setFromRotationMatrix(root));
  const flat = new Vector2(forward.x, forward.z);
  return flat.lengthSq() > 1e-4 ? flat.normalize() : flat.set(0, 1);
}
