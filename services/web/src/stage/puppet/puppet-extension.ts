/** Movements of the puppet that few motions need at once: trunk, fingers and face. Loaded when the first one does. */
import { type Bone, Matrix4, Quaternion, type Vector3 } from "three";
import type { StagedPose } from "../../motion/extension";
import { createWorldTransforms, type Figure, JOINTS, worldTransforms } from "../../motion/skeleton";
import { FACE_BONE } from "./bones";
import { ExtendedBones } from "./extended-bones";
import { FaceBone } from "./face/face-bone";
import { FingerBones } from "./hand/finger-bones";

const rotation = new Quaternion();

export class PuppetExtension {
  readonly #figure: Figure;
  readonly #trunk: ExtendedBones;
  readonly #fingers: FingerBones;
  readonly #face: FaceBone;
  /** World matrices of the streamed figure's joints, while an extension moves the bones elsewhere. */
  readonly #streamedJoints = new Map<string, Matrix4>();
  readonly #streamedWorld = createWorldTransforms();
  #isExtended = false;
  #hasFingers = false;

  constructor(figure: Figure, bone: (name: string) => Bone, fingerTips: readonly Vector3[]) {
    this.#figure = figure;
    this.#trunk = new ExtendedBones(figure, bone);
    this.#fingers = new FingerBones(bone, fingerTips);
    this.#face = new FaceBone(bone(FACE_BONE));
  }

  /** Return trunk and arms to the lengths of the figure, if the next pose is not extended. */
  prepare({ extended }: StagedPose): void {
    if (this.#isExtended && !extended) this.#trunk.reset();
    this.#isExtended = Boolean(extended);
  }

  /** Apply what a pose has beside the figure's rotations, which are applied. `blink` is a weight of 0..1. */
  apply(pose: StagedPose, blink: number): void {
    const { extended, hands, face } = pose;
    if (extended) {
      this.#trunk.apply(extended);
      this.#updateStreamedJoints(pose);
    }
    if (hands) this.#fingers.apply(hands);
    else if (this.#hasFingers) this.#fingers.reset();
    this.#hasFingers = Boolean(hands);
    this.#face.apply(face ?? null, blink);
  }

  /** Return the world matrix of a joint of the streamed figure; undefined if it is that of the bone. */
  streamedJoint(name: string): Matrix4 | undefined {
    return this.#isExtended ? this.#streamedJoints.get(name) : undefined;
  }

  #updateStreamedJoints(pose: StagedPose): void {
    const { positions, orientations } = worldTransforms(this.#figure, pose, this.#streamedWorld);
    JOINTS.forEach((name, k) => {
      const matrix = this.#streamedJoints.get(name) ?? new Matrix4();
      this.#streamedJoints.set(name, matrix);
      rotation.set(orientations[k * 4 + 1], orientations[k * 4 + 2], orientations[k * 4 + 3], orientations[k * 4]);
      matrix
        .makeRotationFromQuaternion(rotation)
        .setPosition(positions[k * 3], positions[k * 3 + 1], positions[k * 3 + 2]);
    });
  }
}
