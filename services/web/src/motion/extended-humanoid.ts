/**
 * The extended figure as a VRM 1.0 humanoid: chest, upper chest, neck and shoulders beside the bones of `humanoid`,
 * from the same T-pose.
 */

import type { BodyExtension, ExtendedPose } from "./extension";
import { BONE_PARENTS, BONES, T_POSE_TO_REST, tPoseFigure } from "./humanoid";
import { conjugate, multiply } from "./rotation";
import { type Figure, JOINTS } from "./skeleton";

/** Bones of the trunk, from the hips upwards. */
export const TRUNK_BONES: readonly string[] = ["spine", "chest", "upperChest"];

const SPINE = BONES.indexOf("spine");
const SACROILIAC = JOINTS.indexOf("sacroiliac");
/** Bones that hang from the trunk: the extension's joint of this kind, and the figure's bone below it. */
const CARRIERS = [
  { bone: "neck", kind: "neck", carried: "head" },
  { bone: "leftShoulder", kind: "left clavicle", carried: "leftUpperArm" },
  { bone: "rightShoulder", kind: "right clavicle", carried: "rightUpperArm" },
] as const;

/**
 * Return the joint of the spine that each of `count` bones of the trunk follows, the last one the chest; -1 for the
 * root, if there is no joint.
 */
export function trunkJoints(spineCount: number, count: number): number[] {
  if (spineCount === 0) return new Array<number>(count).fill(-1);
  if (count === 1) return [spineCount - 1];
  return Array.from({ length: count }, (_, bone) => Math.round((bone * (spineCount - 1)) / (count - 1)));
}

/**
 * A bone of the humanoid, and the joint whose orientation it has: of the figure, or of the extension (-1: the root).
 */
interface HumanoidBone {
  readonly name: string;
  readonly parent: number;
  readonly joint: number;
  readonly isExtra: boolean;
}

/** Bones, lengths and rotations of an extended figure. */
export class ExtendedHumanoid {
  readonly bones: HumanoidBone[] = [];
  /** Positions [bone][3] from the parents in the T-pose, metres; that of the hips from the floor below the root. */
  readonly offsets: Float64Array;
  private readonly world: Float64Array;
  private readonly inverse = new Float64Array(4);

  constructor(figure: Figure, extension: BodyExtension) {
    const { kinds, ends } = extension;
    const { offsets: tPose } = tPoseFigure(figure);
    const offsets: number[] = [];
    const add = (name: string, parent: number, offset: Iterable<number>, joint: number, isExtra: boolean) => {
      offsets.push(...offset);
      return this.bones.push({ name, parent, joint, isExtra }) - 1;
    };
    const placeOf = (joint: number) => extension.offsets.subarray(joint * 3, joint * 3 + 3);
    const indices = new Map<number, number>();
    let chest = -1;
    BONES.forEach((bone, at) => {
      if (at === SPINE) {
        const spineCount = kinds.lastIndexOf("spine") + 1;
        const joints = trunkJoints(spineCount, Math.min(Math.max(spineCount, 1), TRUNK_BONES.length));
        let previous = -1;
        joints.forEach((joint, nth) => {
          const offset = new Float64Array(3);
          if (nth === 0) for (let i = 0; i < 3; i++) offset[i] = -figure.offsets[SACROILIAC * 3 + i];
          for (let below = previous + 1; below <= joint; below++)
            for (let i = 0; i < 3; i++) offset[i] += placeOf(below)[i];
          chest = add(TRUNK_BONES[nth], nth === 0 ? 0 : chest, offset, joint, true);
          previous = joint;
        });
        return;
      }
      const end = CARRIERS.findIndex(({ carried }) => carried === bone);
      let parent = BONE_PARENTS[at] < 0 ? -1 : (indices.get(BONE_PARENTS[at]) as number);
      let offset = tPose.subarray(at * 3, at * 3 + 3);
      if (end >= 0) {
        const carrier = kinds.indexOf(CARRIERS[end].kind);
        parent = carrier < 0 ? chest : add(CARRIERS[end].bone, chest, placeOf(carrier), carrier, true);
        offset = ends.subarray(end * 3, end * 3 + 3);
      }
      indices.set(at, add(bone, parent, offset, at + 1, false));
    });
    this.offsets = Float64Array.from(offsets);
    this.world = new Float64Array(this.bones.length * 4);
  }

  /** Write the rotations [bone][w x y z] of a pose: that of the hips in the world, others in their parents' frames. */
  rotations(pose: ExtendedPose, out: Float64Array): void {
    const { bones, world, inverse } = this;
    bones.forEach(({ parent, joint, isExtra }, bone) => {
      const at = bone * 4;
      if (isExtra && joint >= 0) world.set(pose.extraOrientations.subarray(joint * 4, joint * 4 + 4), at);
      else if (isExtra) world.set(pose.orientations.subarray(0, 4), at);
      else multiply(world, at, pose.orientations, joint * 4, T_POSE_TO_REST, joint * 4);
      if (parent < 0) {
        out.set(world.subarray(at, at + 4), at);
        return;
      }
      conjugate(inverse, 0, world, parent * 4);
      multiply(out, at, inverse, 0, world, at);
    });
  }
}
