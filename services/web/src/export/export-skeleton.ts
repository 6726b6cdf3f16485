/**
 * Skeleton of an exported file: the joints of the figure, and those of its extension in their places (`proto/codec.md`,
 * 2.17). Local rotations of such a skeleton give the extended pose.
 */

import {
  type BodyExtension,
  createExtendedPose,
  END_JOINTS,
  type ExtendedPose,
  extendPose,
  type JointKind,
} from "../motion/extension";
import { conjugate, multiply } from "../motion/rotation";
import {
  createWorldTransforms,
  type Figure,
  JOINT_COUNT,
  JOINTS,
  PARENTS,
  type Pose,
  TIP_JOINTS,
  worldTransforms,
} from "../motion/skeleton";

const VL5 = JOINTS.indexOf("vl5");
/** Kind of the joint that carries each end joint. */
const CARRIERS: readonly JointKind[] = ["neck", "left clavicle", "right clavicle"];

/** Extension of a sampled motion: values [frame][E][3], radians. */
export interface SampledExtension {
  readonly extension: BodyExtension;
  readonly values: Float64Array;
}

/** A joint of the file: one of the figure, by its index, or of the extension. */
interface Source {
  readonly joint: number;
  readonly isExtra: boolean;
}

export class ExportSkeleton {
  readonly names: string[] = [];
  /** Parent of each joint, -1 for the root. */
  readonly parents: number[] = [];
  /** Positions [joint][3] from the parents at rest, metres. */
  readonly offsets: Float64Array;
  /** Tips (3) of the joints that have one, by index. */
  readonly tips = new Map<number, Float64Array>();
  /** Index of the joint that carries neck and clavicles. */
  readonly chest: number;
  private readonly sources: Source[] = [];
  private readonly world = createWorldTransforms();
  private readonly extended: ExtendedPose | null;
  private readonly inverse = new Float64Array(4);

  constructor(
    private readonly figure: Figure,
    extension: BodyExtension | null = null,
  ) {
    this.extended = extension && createExtendedPose(extension);
    const offsets: number[] = [];
    const add = (name: string, parent: number, offset: Iterable<number>, source: Source) => {
      offsets.push(...offset);
      this.sources.push(source);
      this.parents.push(parent);
      return this.names.push(name) - 1;
    };
    const places = new Array<number>(JOINT_COUNT).fill(-1);
    let chest = 0;
    JOINTS.forEach((name, joint) => {
      let parent = joint === 0 ? -1 : places[PARENTS[joint]];
      let offset = figure.offsets.subarray(joint * 3, joint * 3 + 3);
      const addExtra = (extra: number, from: number) =>
        add(
          (extension as BodyExtension).names[extra],
          from,
          (extension as BodyExtension).offsets.subarray(extra * 3, extra * 3 + 3),
          { joint: extra, isExtra: true },
        );
      const end = END_JOINTS.indexOf(joint);
      if (extension && joint === VL5 && extension.kinds[0] === "spine") {
        for (let extra = 0; extension.kinds[extra] === "spine"; extra++)
          chest = addExtra(extra, extra === 0 ? 0 : chest);
        places[VL5] = chest;
        return;
      }
      if (extension && end >= 0) {
        const carrier = extension.kinds.indexOf(CARRIERS[end]);
        parent = carrier < 0 ? chest : addExtra(carrier, chest);
        offset = extension.ends.subarray(end * 3, end * 3 + 3);
      }
      places[joint] = add(name, parent, offset, { joint, isExtra: false });
      if (TIP_JOINTS.includes(joint)) this.tips.set(places[joint], figure.tips.subarray(joint * 3, joint * 3 + 3));
    });
    this.chest = extension ? chest : places[VL5];
    this.offsets = Float64Array.from(offsets);
  }

  get count(): number {
    return this.names.length;
  }

  /** Return the index of a joint, or -1 if there is none of this name. */
  indexOf(name: string): number {
    return this.names.indexOf(name);
  }

  /** Return the positions [joint][3] at rest relative to the figure's origin, metres. */
  restPositions(): Float64Array {
    const places = this.offsets.slice();
    this.parents.forEach((parent, joint) => {
      if (parent >= 0) for (let axis = 0; axis < 3; axis++) places[joint * 3 + axis] += places[parent * 3 + axis];
    });
    return places;
  }

  /** Return the extended pose for `values` [E][3], or null without an extension. The next call reuses the storage. */
  extend(pose: Pose, values: Float64Array | null): ExtendedPose | null {
    const { extended, world, figure } = this;
    return extended && values && extendPose(figure, worldTransforms(figure, pose, world), values, extended);
  }

  /** Write the rotations [joint][w x y z] of a pose in the frames of the parents. */
  rotations(pose: Pose, values: Float64Array | null, out: Float64Array): void {
    const extended = this.extend(pose, values);
    if (!extended) {
      out.set(pose.rotations);
      return;
    }
    const { inverse } = this;
    const orientation = ({ joint, isExtra }: Source) =>
      [isExtra ? extended.extraOrientations : extended.orientations, joint * 4] as const;
    this.sources.forEach((source, joint) => {
      const own = orientation(source);
      const parent = this.parents[joint];
      if (parent < 0) {
        for (let i = 0; i < 4; i++) out[joint * 4 + i] = own[0][own[1] + i];
        return;
      }
      conjugate(inverse, 0, ...orientation(this.sources[parent]));
      multiply(out, joint * 4, inverse, 0, ...own);
    });
  }
}
