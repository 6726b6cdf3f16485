/** Rotations of the bones that an avatar has, from a figure's pose or its extended pose. */
import { TRUNK_BONES, trunkJoints } from "../motion/extended-humanoid";
import type { ExtendedPose, JointKind } from "../motion/extension";
import { BONE_PARENTS, BONES, T_POSE_TO_REST } from "../motion/humanoid";
import { conjugate, multiply } from "../motion/rotation";
import { JOINTS, type WorldTransforms } from "../motion/skeleton";

/** Bones that an extension moves, with the bone above each, and the joint that moves it. */
const EXTRA_BONES: Readonly<Record<string, { readonly above: string; readonly kind?: JointKind }>> = {
  chest: { above: "spine" },
  upperChest: { above: "chest" },
  neck: { above: "upperChest", kind: "neck" },
  leftShoulder: { above: "upperChest", kind: "left clavicle" },
  rightShoulder: { above: "upperChest", kind: "right clavicle" },
};
/** Bones that hang from those. */
const CARRIED: Readonly<Record<string, string>> = {
  head: "neck",
  leftUpperArm: "leftShoulder",
  rightUpperArm: "rightShoulder",
};

/** All bones that a pose can move; parents come before their children. */
export const DRIVEN_BONES: readonly string[] = [
  ...BONES.slice(0, BONES.indexOf("spine") + 1),
  ...Object.keys(EXTRA_BONES),
  ...BONES.slice(BONES.indexOf("spine") + 1),
];

const VL5 = JOINTS.indexOf("vl5");

export class BoneOrientations {
  /** Bones that the avatar has, and the index of the driven bone above each, -1 for the hips. */
  readonly bones: readonly string[];
  readonly parents: readonly number[];
  private readonly world: Float64Array;
  private readonly inverse = new Float64Array(4);

  /** @param has whether the avatar has a bone */
  constructor(has: (bone: string) => boolean) {
    this.bones = DRIVEN_BONES.filter((bone) => BONES.includes(bone) || has(bone));
    this.parents = this.bones.map((bone) => {
      let above = aboveBone(bone);
      while (above !== null && !this.bones.includes(above)) above = aboveBone(above);
      return above === null ? -1 : this.bones.indexOf(above);
    });
    this.world = new Float64Array(this.bones.length * 4);
  }

  /**
   * Write the rotation [bone][w x y z] of each bone from the T-pose, in the frame of its parent; that of the hips in
   * the world.
   */
  rotations(world: WorldTransforms, extended: ExtendedPose | null, out: Float64Array): void {
    const { bones, parents, inverse } = this;
    const trunk = TRUNK_BONES.filter((bone) => bones.includes(bone));
    const kinds = extended?.extension.kinds ?? [];
    const spineCount = kinds.lastIndexOf("spine") + 1;
    const spine = trunkJoints(spineCount, trunk.length);
    bones.forEach((bone, index) => {
      const joint = BONES.indexOf(bone) + 1;
      const extra = EXTRA_BONES[bone];
      if (!extra && !(extended && bone === "spine")) {
        const { orientations } = extended ?? world;
        multiply(this.world, index * 4, orientations, joint * 4, T_POSE_TO_REST, joint * 4);
        return;
      }
      const level = trunk.indexOf(bone);
      const carrier = extra?.kind ? kinds.indexOf(extra.kind) : -1;
      const source = level >= 0 ? spine[level] : carrier >= 0 ? carrier : spineCount - 1;
      const [orientations, at] = !extended
        ? [world.orientations, VL5]
        : source < 0
          ? [world.orientations, 0]
          : [extended.extraOrientations, source];
      this.world.set(orientations.subarray(at * 4, at * 4 + 4), index * 4);
    });
    bones.forEach((_, index) => {
      const at = index * 4;
      if (parents[index] < 0) {
        out.set(this.world.subarray(at, at + 4), at);
        return;
      }
      conjugate(inverse, 0, this.world, parents[index] * 4);
      multiply(out, at, inverse, 0, this.world, at);
    });
  }
}

/** Return the bone above another in a full humanoid; null above the hips. */
function aboveBone(bone: string): string | null {
  if (bone in EXTRA_BONES) return EXTRA_BONES[bone].above;
  if (bone in CARRIED) return CARRIED[bone];
  const parent = BONE_PARENTS[BONES.indexOf(bone)];
  return parent < 0 ? null : BONES[parent];
}
