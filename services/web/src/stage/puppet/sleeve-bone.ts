/** Bone of a sleeve's bag: it hangs by gravity with a damped swing, never closer than 25 degrees to the arm. */
import { type Bone, Matrix4, Vector3 } from "three";
import type { Side } from "./standard-figure";

const MIN_SIN = 0.42;
const SWING_RAD_PER_S = 2 * Math.PI * 1.6;
const DAMPING_RATIO = 0.35;
/** Longer steps are jumps, not swings, in seconds. */
const MAX_STEP_S = 0.1;

export interface SleeveJoints {
  shoulder: Bone;
  elbow: Bone;
  chest: Bone;
}

export class SleeveBone {
  readonly #bone: Bone;
  readonly #joints: SleeveJoints;
  readonly #sign: number;
  readonly #bindInverse: Matrix4;
  readonly #swing = new Vector3();
  readonly #speed = new Vector3();
  #isInitialised = false;

  /** `along` is the upper arm's direction in the rest pose, in which the bag hangs to the back. */
  constructor(bone: Bone, side: Side, joints: SleeveJoints, along: Vector3) {
    this.#bone = bone;
    this.#joints = joints;
    this.#sign = side === "l" ? 1 : -1;
    this.#bindInverse = new Matrix4()
      .makeBasis(along.clone().normalize(), new Vector3(0, 0, -1), new Vector3(this.#sign, 0, 0))
      .invert();
    bone.matrixAutoUpdate = false;
    bone.matrixWorldAutoUpdate = false;
  }

  /** Place the bone for the current pose. `seconds` is the time since the last call; 0 stops the swing. */
  update(seconds: number): void {
    const from = new Vector3().setFromMatrixPosition(this.#joints.shoulder.matrixWorld);
    const arm = new Vector3().setFromMatrixPosition(this.#joints.elbow.matrixWorld).sub(from).normalize();
    const chest = this.#joints.chest.matrixWorld;
    const back = new Vector3(0.35 * this.#sign, 0, -1).transformDirection(chest);
    const rest = new Vector3(0, -1, 0).addScaledVector(back, 0.3).normalize();
    const hang = this.#stepSwing(rest, seconds);

    const along = hang.dot(arm);
    const across = hang.clone().addScaledVector(arm, -along);
    const sine = Math.max(across.length(), MIN_SIN);
    if (across.lengthSq() < 1e-6) across.copy(back).addScaledVector(arm, -back.dot(arm));
    across.normalize();
    const cosine = Math.sign(along) * Math.sqrt(Math.max(0, 1 - sine * sine));
    const fall = arm.clone().multiplyScalar(cosine).addScaledVector(across, sine);
    // Arm x back points to the figure's left: the right side keeps its mirrored basis, else the cloth turns inside out.
    const lateral = arm.clone().cross(across).multiplyScalar(this.#sign);
    this.#bone.matrixWorld.makeBasis(arm, fall, lateral).multiply(this.#bindInverse).setPosition(from);
    this.#bone.matrix.copy(this.#bone.matrixWorld);
  }

  #stepSwing(rest: Vector3, seconds: number): Vector3 {
    if (!this.#isInitialised || seconds <= 0 || seconds > MAX_STEP_S) {
      this.#isInitialised = true;
      this.#speed.set(0, 0, 0);
      return this.#swing.copy(rest);
    }
    const pull = rest
      .clone()
      .sub(this.#swing)
      .multiplyScalar(SWING_RAD_PER_S * SWING_RAD_PER_S)
      .addScaledVector(this.#speed, -2 * DAMPING_RATIO * SWING_RAD_PER_S);
    this.#speed.addScaledVector(pull, seconds);
    return this.#swing.addScaledVector(this.#speed, seconds).normalize();
  }
}
