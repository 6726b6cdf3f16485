/**
 * Skeleton of an exported file: the joints of the figure, those of its extension in their places, and those of the
 * fingers below the wrists (`proto/codec.md`, 2.17 and 2.18). Local rotations of such a skeleton give the extended
 * pose.
 */

import {
  type BodyExtension,
  createExtendedPose,
  END_JOINTS,
  type ExtendedPose,
  extendPose,
  type JointKind,
} from "../motion/extension";
import {
  CHAIN_COUNT,
  chainDirection,
  FINGERS,
  HANIM_NAMES,
  type Hands,
  MAX_CHAIN_JOINTS,
  WRISTS,
} from "../motion/hands";
import { conjugate, fromRotationVector, multiply } from "../motion/rotation";
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

/** Values of a frame: of the extension [E][3] and of the fingers [E][3], radians; null without. */
export interface FrameValues {
  readonly extension: Float64Array | null;
  readonly hands: Float64Array | null;
}

/** A joint of the file: one of the figure, of the extension or of the fingers, by its index. */
interface Source {
  readonly joint: number;
  readonly part: "figure" | "extension" | "fingers";
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
    hands: Hands | null = null,
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
          { joint: extra, part: "extension" },
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
      places[joint] = add(name, parent, offset, { joint, part: "figure" });
      const side = WRISTS.indexOf(joint);
      const fingers = hands && side >= 0 ? handJoints(hands, side) : [];
      const first = this.count;
      for (const { name: finger, place, index, offset: from, tip } of fingers) {
        const added = add(finger, place === 0 ? places[joint] : this.count - 1, from, {
          joint: index,
          part: "fingers",
        });
        if (tip) this.tips.set(added, tip);
      }
      if (TIP_JOINTS.includes(joint) && this.count === first)
        this.tips.set(places[joint], figure.tips.subarray(joint * 3, joint * 3 + 3));
    });
    this.chest = extension ? chest : places[VL5];
    this.offsets = Float64Array.from(offsets);
  }

  get count(): number {
    return this.names.length;
  }

  get hasExtension(): boolean {
    return this.extended !== null;
  }

  /** Indices of the joints of the fingers. */
  get fingerJoints(): number[] {
    return this.sources.flatMap(({ part }, index) => (part === "fingers" ? [index] : []));
  }

  /** Return the index of the wrist that carries a joint of a finger. */
  wristOf(joint: number): number {
    let above = joint;
    while (this.sources[above].part === "fingers") above = this.parents[above];
    return above;
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
  rotations(pose: Pose, values: FrameValues, out: Float64Array): void {
    const extended = this.extend(pose, values.extension);
    this.sources.forEach(({ joint, part }, index) => {
      const parent = this.parents[index];
      if (part === "fingers") {
        const [x, y, z] = values.hands?.subarray(joint * 3) ?? NO_ROTATION;
        fromRotationVector(out, index * 4, x, y, z);
      } else if (!extended) {
        out.set(pose.rotations.subarray(joint * 4, joint * 4 + 4), index * 4);
      } else if (parent < 0) {
        out.set(extended.orientations.subarray(joint * 4, joint * 4 + 4), index * 4);
      } else {
        conjugate(this.inverse, 0, ...orientationIn(extended, this.sources[parent]));
        multiply(out, index * 4, this.inverse, 0, ...orientationIn(extended, this.sources[index]));
      }
    });
  }
}

const NO_ROTATION = [0, 0, 0];

/** Return the array with the world orientation of a joint of figure or extension, and the position in it. */
function orientationIn(extended: ExtendedPose, { joint, part }: Source): readonly [Float64Array, number] {
  return [part === "extension" ? extended.extraOrientations : extended.orientations, joint * 4];
}

/** A joint of a finger: its index among all, its place in the finger, and its position from the joint before. */
interface FingerJoint {
  readonly name: string;
  readonly index: number;
  readonly place: number;
  readonly offset: Float64Array;
  /** End of the last bone of the finger. */
  readonly tip: Float64Array | null;
}

/** Return the joints of the fingers of a side, each finger from the wrist outwards. */
export function handJoints({ counts, bases, lengths }: Hands, side: number): FingerJoint[] {
  const joints: FingerJoint[] = [];
  let index = 0;
  for (let chain = 0; chain < CHAIN_COUNT; chain++) {
    const direction = chainDirection(chain);
    const bone = (place: number) =>
      Float64Array.from(direction, (axis) => axis * lengths[chain * MAX_CHAIN_JOINTS + place]);
    for (let place = 0; place < counts[chain]; place++, index++) {
      if (Math.floor(chain / FINGERS.length) !== side) continue;
      joints.push({
        name: HANIM_NAMES[chain][place],
        index,
        place,
        offset: place === 0 ? bases.slice(chain * 3, chain * 3 + 3) : bone(place - 1),
        tip: place === counts[chain] - 1 ? bone(place) : null,
      });
    }
  }
  return joints;
}
