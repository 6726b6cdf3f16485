/** Movement of the puppet's fingers by those of a performer. */
import { type Bone, Quaternion, Vector3 } from "three";
import { chainDirection, FINGERS, type HandsPose, MAX_CHAIN_JOINTS } from "../../../motion/hands";
import { FINGER_BONES } from "./finger-joints";

/** Bend of a joint that the performer lacks, as a share of that before it. */
const CARRIED_BEND = [1, 0.9, 0.65];
/** A joint that was carried along bends at most this far, in radians. */
const MAX_CARRIED_RAD = 1.7;

/**
 * Sets the bones of the fingers, which have the puppet's own lengths. The mesh has a slight curl at rest, where the
 * performer's fingers are straight: each bone first turns its segment to the direction of the straight finger.
 */
export class FingerBones {
  readonly #bones: readonly Bone[];
  /** Rotation of each segment to the direction of the straight finger, and its inverse. */
  readonly #straighten: Quaternion[] = [];
  readonly #curl: Quaternion[] = [];
  /** Axis about which each chain bends to the palm. */
  readonly #bendAxes: Vector3[] = [];

  /** `tips` are the positions of the tips of all chains from the last joint, at rest. */
  constructor(bone: (name: string) => Bone, tips: readonly Vector3[]) {
    this.#bones = FINGER_BONES.map(bone);
    tips.forEach((tip, chain) => {
      const straight = new Vector3().fromArray(chainDirection(chain));
      for (let place = 0; place < MAX_CHAIN_JOINTS; place++) {
        const next = this.#bones[chain * MAX_CHAIN_JOINTS + place + 1];
        const along = (place + 1 < MAX_CHAIN_JOINTS ? next.position : tip).clone().normalize();
        const turn = new Quaternion().setFromUnitVectors(along, straight);
        this.#straighten.push(turn);
        this.#curl.push(turn.clone().invert());
      }
      const palm = new Vector3(chain < FINGERS.length ? -1 : 1, 0, 0);
      this.#bendAxes.push(straight.cross(palm));
    });
  }

  /**
   * Set the bones. A finger that the performer lacks keeps its curl; the outer joints of one that is known in part bend
   * with it.
   */
  apply({ hands, values }: HandsPose): void {
    let joint = 0;
    hands.counts.forEach((count, chain) => {
      for (let place = 0; place < MAX_CHAIN_JOINTS; place++) {
        if (count === 0) this.#bones[chain * MAX_CHAIN_JOINTS + place].quaternion.identity();
        else {
          if (place < count) turnVector.fromArray(values, (joint + place) * 3);
          else this.#carryBend(chain, place);
          this.#turn(chain * MAX_CHAIN_JOINTS + place, place);
        }
      }
      joint += count;
    });
    for (const bone of this.#bones) bone.updateMatrix();
  }

  /** Return all fingers to rest. */
  reset(): void {
    for (const bone of this.#bones) {
      bone.quaternion.identity();
      bone.updateMatrix();
    }
  }

  /** Write the bend that follows from that of the joint before into `turnVector`. */
  #carryBend(chain: number, place: number): void {
    const axis = this.#bendAxes[chain];
    const bend = Math.min(Math.max(turnVector.dot(axis) * CARRIED_BEND[place], 0), MAX_CARRIED_RAD);
    turnVector.copy(axis).multiplyScalar(bend);
  }

  /** Turn a bone by `turnVector` in the frame of the straight finger before it. */
  #turn(index: number, place: number): void {
    const angle = turnVector.length();
    turn.setFromAxisAngle(axis.copy(turnVector).divideScalar(angle || 1), angle);
    const { quaternion } = this.#bones[index];
    if (place > 0) quaternion.copy(this.#curl[index - 1]).multiply(turn);
    else quaternion.copy(turn);
    quaternion.multiply(this.#straighten[index]);
  }
}

const turnVector = new Vector3();
const axis = new Vector3();
const turn = new Quaternion();
