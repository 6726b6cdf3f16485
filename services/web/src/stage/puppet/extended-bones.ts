/** Movement of the puppet's bones by an extended pose: a bending trunk, and shoulders that clavicles carry. */
import { type Bone, Quaternion, Vector3 } from "three";
import type { ExtendedPose } from "../../motion/extension";
import { type Figure, JOINTS } from "../../motion/skeleton";

/** Bones of the puppet's trunk beside those of the figure; without an extension they follow vl5. */
export const TRUNK_BONES: readonly string[] = ["chest", "neck", "l_clavicle", "r_clavicle"];

const VL5 = JOINTS.indexOf("vl5");
/** Joints whose bones an extension moves, parents before children. */
const MOVED_JOINTS = ["skullbase", "l_shoulder", "l_elbow", "l_wrist", "r_shoulder", "r_elbow", "r_wrist"];

export class ExtendedBones {
  readonly #figure: Figure;
  /** Bone by name. */
  readonly #bone: (name: string) => Bone;
  readonly #world = new Map<string, { readonly position: Vector3; readonly rotation: Quaternion }>();

  constructor(figure: Figure, bone: (name: string) => Bone) {
    this.#figure = figure;
    this.#bone = bone;
  }

  /** Set the bones of trunk, head and arms to an extended pose; those of root and legs are set already. */
  apply(pose: ExtendedPose): void {
    const { kinds } = pose.extension;
    this.#setWorld("humanoid_root", pose.positions, pose.orientations, 0);
    const chest = kinds.lastIndexOf("spine");
    this.#moveTrunkBone("vl5", pose, chest < 0 ? -1 : 0);
    this.#moveTrunkBone("chest", pose, chest);
    this.#moveTrunkBone("neck", pose, Math.max(kinds.indexOf("neck"), chest));
    this.#moveTrunkBone("l_clavicle", pose, Math.max(kinds.indexOf("left clavicle"), chest));
    this.#moveTrunkBone("r_clavicle", pose, Math.max(kinds.indexOf("right clavicle"), chest));
    for (const name of MOVED_JOINTS) {
      this.#setWorld(name, pose.positions, pose.orientations, JOINTS.indexOf(name));
      this.#place(name);
    }
  }

  /** Return the bones to the lengths of the figure alone. */
  reset(): void {
    for (const name of ["vl5", ...MOVED_JOINTS])
      this.#bone(name).position.fromArray(this.#figure.offsets, JOINTS.indexOf(name) * 3);
    for (const name of TRUNK_BONES) {
      this.#bone(name).position.set(0, 0, 0);
      this.#bone(name).quaternion.identity();
    }
  }

  /**
   * Move a bone of the trunk with a joint of the extension; -1 is the figure's own vl5. At rest all these bones are at
   * the figure's vl5.
   */
  #moveTrunkBone(name: string, pose: ExtendedPose, joint: number): void {
    if (joint < 0) {
      this.#setWorld(name, pose.positions, pose.orientations, VL5);
    } else {
      this.#setWorld(name, pose.extraPositions, pose.extraOrientations, joint);
      const world = this.#transform(name);
      const pivot = new Vector3().fromArray(this.#figure.offsets, VL5 * 3).sub(restPosition(pose, joint));
      world.position.add(pivot.applyQuaternion(world.rotation));
    }
    this.#place(name);
  }

  #transform(name: string): { readonly position: Vector3; readonly rotation: Quaternion } {
    let world = this.#world.get(name);
    if (!world) this.#world.set(name, (world = { position: new Vector3(), rotation: new Quaternion() }));
    return world;
  }

  #setWorld(name: string, positions: Float64Array, orientations: Float64Array, joint: number): void {
    const { position, rotation } = this.#transform(name);
    const at = joint * 4;
    position.fromArray(positions, joint * 3);
    rotation.set(orientations[at + 1], orientations[at + 2], orientations[at + 3], orientations[at]);
  }

  /** Set a bone's transform in its parent's frame. */
  #place(name: string): void {
    const bone = this.#bone(name);
    const parent = this.#transform((bone.parent as Bone).name),
      { position, rotation } = this.#transform(name);
    const inverse = parent.rotation.clone().invert();
    bone.position.copy(position).sub(parent.position).applyQuaternion(inverse);
    bone.quaternion.copy(inverse).multiply(rotation);
  }
}

/** Return the position of a joint of an extension at rest, from the root. */
function restPosition({ extension: { kinds, offsets } }: ExtendedPose, joint: number): Vector3 {
  const place = new Vector3().fromArray(offsets, joint * 3);
  const first = kinds[joint] === "spine" ? joint : kinds.lastIndexOf("spine") + 1;
  for (let below = 0; below < first; below++) place.add(new Vector3().fromArray(offsets, below * 3));
  return place;
}
