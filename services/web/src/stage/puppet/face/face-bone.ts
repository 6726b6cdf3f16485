/** Bone that carries the expression of one puppet's face to the shader, in the matrix that its skeleton has for it. */
import type { Bone } from "three";
import type { FacePose } from "../../../motion/face";
import { FaceExpression } from "./expression";

export class FaceBone {
  readonly #bone: Bone;
  readonly #expression = new FaceExpression();

  constructor(bone: Bone) {
    this.#bone = bone;
  }

  /**
   * Show a pose of the face, or the painted one. `blink` (0..1) closes the eyes where the pose says nothing of them.
   */
  apply(pose: FacePose | null, blink: number): void {
    const { elements } = this.#bone.matrixWorld;
    this.#expression.update(pose, blink).forEach((value, at) => (elements[at] = value));
  }
}
