/**
 * Placement of the stage in the room of an immersive session: the transform from the room (metres, y up, floor at 0) to
 * the stage's world frame. Pure.
 */
import { Matrix4, Quaternion, Vector3 } from "three";

/** Size of the stage in the room: as large as life, or a quarter of that. */
export type StageSize = "1:1" | "1:4";

/** A place on the stage: its centre on the floor, and the turn to its front, in radians about y from z towards x. */
export interface StageSpot {
  readonly centre: Vector3;
  readonly front: number;
}

/** Metres of the room per metre of the stage. */
const SCALES: Readonly<Record<StageSize, number>> = { "1:1": 1, "1:4": 0.25 };
/** Distance between the viewer and the centre of the stage, in metres of the room. */
const DISTANCES_M: Readonly<Record<StageSize, number>> = { "1:1": 1, "1:4": 0.55 };
/** A small stage is this far below the viewer's eyes, like a table, within these limits, in metres of the room. */
const TABLE_DEPTH_M = 0.62;
const TABLE_HEIGHT_M = [0.35, 1.1] as const;
/** The stage is placed anew for performers who are further away from its centre, in metres of the stage. */
export const MAX_DISTANCE_M = 1.6;

const UP = new Vector3(0, 1, 0);

export class Placement {
  /** Transform from the room to the stage's world frame. */
  readonly matrix = new Matrix4();
  size: StageSize;
  /** Place in the room where the centre of the stage is. */
  readonly #anchor = new Vector3();
  readonly #centre = new Vector3();
  /** Turn from the room to the stage, in radians about y. */
  #turn = 0;

  constructor(size: StageSize) {
    this.size = size;
  }

  /** Metres of the stage per metre of the room. */
  get stagePerRoom(): number {
    return 1 / SCALES[this.size];
  }

  /** Height of the stage's floor in the room. */
  get floorHeight(): number {
    return this.#anchor.y;
  }

  /** Centre of the stage, in its world frame. */
  get centre(): Vector3 {
    return this.#centre;
  }

  /** Put the stage in front of a viewer, whose pose in the room is `viewer`, with its front towards the viewer. */
  place(viewer: Matrix4, { centre, front }: StageSpot): void {
    const eyes = new Vector3().setFromMatrixPosition(viewer);
    const ahead = headingOf(viewer);
    this.#anchor.copy(eyes).addScaledVector(ahead, DISTANCES_M[this.size]);
    this.#anchor.y =
      this.size === "1:1" ? 0 : Math.min(Math.max(eyes.y - TABLE_DEPTH_M, TABLE_HEIGHT_M[0]), TABLE_HEIGHT_M[1]);
    this.#centre.copy(centre);
    this.#turn = front - Math.atan2(-ahead.x, -ahead.z);
    this.#update();
  }

  /** Turn the viewer, whose pose in the room is `viewer`, on the spot: by radians to the left. */
  turn(angle: number, viewer: Matrix4): void {
    const eyes = new Vector3().setFromMatrixPosition(viewer).setY(0);
    const height = this.#anchor.y;
    this.#anchor.setY(0).sub(eyes).applyAxisAngle(UP, -angle).add(eyes).setY(height);
    this.#turn += angle;
    this.#update();
  }

  /** Move the stage's floor to a height of the stage's world frame, where feet stand on it. */
  setGround(height: number): void {
    this.#centre.y = height;
    this.#update();
  }

  /** Move another place of the stage to where its centre is in the room. */
  moveTo({ x, z }: Vector3): void {
    this.#centre.set(x, this.#centre.y, z);
    this.#update();
  }

  /**
   * Return true if a place of the stage is too far from the stage's centre to be reached from where the viewer stands.
   */
  isFar({ x, z }: Vector3): boolean {
    return Math.hypot(x - this.#centre.x, z - this.#centre.z) > MAX_DISTANCE_M;
  }

  #update(): void {
    const scale = this.stagePerRoom;
    const rotation = new Quaternion().setFromAxisAngle(UP, this.#turn);
    const offset = this.#anchor.clone().applyQuaternion(rotation).multiplyScalar(-scale).add(this.#centre);
    this.matrix.compose(offset, rotation, new Vector3(scale, scale, scale));
  }
}

/**
 * Return the horizontal direction that a viewer looks at. Who looks straight up or down faces where the head's top
 * does.
 */
function headingOf(viewer: Matrix4): Vector3 {
  const ahead = new Vector3().setFromMatrixColumn(viewer, 2).negate();
  const up = new Vector3().setFromMatrixColumn(viewer, 1).multiplyScalar(-Math.sign(ahead.y));
  const heading = Math.hypot(ahead.x, ahead.z) > 0.2 ? ahead : up;
  return heading.setY(0).lengthSq() > 0 ? heading.normalize() : heading.set(0, 0, -1);
}
