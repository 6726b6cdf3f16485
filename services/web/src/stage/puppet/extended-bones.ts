/** Movement of the puppet's bones by an extended pose: a bending trunk, and shoulders that clavicles carry. */
import { type Bone, Quaternion, Vector3 } from "three";
import { type BodyExtension, END_JOINTS, type ExtendedPose, type JointKind } from "../../motion/extension";
import { type Figure, JOINTS } from "../../motion/skeleton";
import { TRUNK_BONES } from "./bones";
import { restPositions } from "./figure-fit";

const VL5 = JOINTS.indexOf("vl5");
/** Joints whose bones an extension moves, parents before children. */
const MOVED_JOINTS = ["skullbase", "l_shoulder", "l_elbow", "l_wrist", "r_shoulder", "r_elbow", "r_wrist"];

/** Joints that an extension carries, in the order of its `ends`. */
const END_NAMES = END_JOINTS.map((joint) => JOINTS[joint]);

export class ExtendedBones {
  readonly #figure: Figure;
  /** Bone by name. */
  readonly #bone: (name: string) => Bone;
  /** Positions of the figure's joints at rest, from the root. */
  readonly #figureRest: ReadonlyMap<string, Vector3>;
  readonly #world = new Map<string, { readonly position: Vector3; readonly rotation: Quaternion }>();
  /** Extension for which the pivots were computed. */
  #extension: BodyExtension | null = null;
  #pivots = new Map<string, Vector3>();

  constructor(figure: Figure, bone: (name: string) => Bone) {
    this.#figure = figure;
    this.#bone = bone;
    const rest = restPositions(figure);
    const root = rest.get("humanoid_root") as Vector3;
    this.#figureRest = new Map([...rest].map(([name, at]) => [name, at.clone().sub(root)]));
  }

  /** Set the bones of trunk, head and arms to an extended pose; those of root and legs are set already. */
  apply(pose: ExtendedPose): void {
    if (this.#extension !== pose.extension) this.#setExtension(pose.extension);
    this.#setWorld("humanoid_root", pose.positions, pose.orientations, 0);
    for (const [name, joint] of pairTrunkBones(pose.extension)) {
      if (joint < 0) {
        this.#setWorld(name, pose.positions, pose.orientations, VL5);
      } else {
        this.#setWorld(name, pose.extraPositions, pose.extraOrientations, joint);
        const { position, rotation } = this.#transform(name);
        position.add(scratch.copy(this.#pivots.get(name) as Vector3).applyQuaternion(rotation));
      }
      this.#place(name);
    }
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
   * Compute where the trunk's bones are in the frames of the joints that move them. The mesh was made for the figure at
   * rest, whose trunk has other lengths. So each bone carries one point of the mesh to its place: the neck the base of
   * the head, a clavicle the shoulder, the chest the middle of the shoulders.
   */
  #setExtension(extension: BodyExtension): void {
    this.#extension = extension;
    const rest = restPositionsOf(extension);
    const figureRest = (name: string) => this.#figureRest.get(name) as Vector3;
    const ends = new Map(END_NAMES.map((name, end) => [name, rest.ends[end]]));
    const middle = (at: (name: string) => Vector3) =>
      at("l_shoulder").clone().add(at("r_shoulder")).multiplyScalar(0.5);
    const anchors: Readonly<Record<string, readonly [extended: Vector3, figure: Vector3]>> = {
      vl5: [new Vector3(), new Vector3()],
      chest: [middle((name) => ends.get(name) as Vector3), middle(figureRest)],
      neck: [ends.get("skullbase") as Vector3, figureRest("skullbase")],
      l_clavicle: [ends.get("l_shoulder") as Vector3, figureRest("l_shoulder")],
      r_clavicle: [ends.get("r_shoulder") as Vector3, figureRest("r_shoulder")],
    };
    this.#pivots = new Map(
      pairTrunkBones(extension).map(([name, joint]) => {
        const [extended, figure] = anchors[name];
        const pivot = extended.clone().sub(figure).add(figureRest("vl5"));
        return [name, joint < 0 ? pivot : pivot.sub(rest.joints[joint])];
      }),
    );
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
    const inverse = scratchRotation.copy(parent.rotation).invert();
    bone.position.copy(position).sub(parent.position).applyQuaternion(inverse);
    bone.quaternion.copy(inverse).multiply(rotation);
  }
}

const scratch = new Vector3();
const scratchRotation = new Quaternion();

/** Return the bones of the trunk with the joint of the extension that moves each; -1 is the figure's own vl5. */
function pairTrunkBones({ kinds }: BodyExtension): [bone: string, joint: number][] {
  const chest = kinds.lastIndexOf("spine");
  const orChest = (kind: JointKind) => (kinds.includes(kind) ? kinds.indexOf(kind) : chest);
  return [
    ["vl5", Math.min(chest, 0)],
    ["chest", chest],
    ["neck", orChest("neck")],
    ["l_clavicle", orChest("left clavicle")],
    ["r_clavicle", orChest("right clavicle")],
  ];
}

/** Return the positions of an extension's joints, and of skullbase and shoulders, at rest from the root. */
export function restPositionsOf({ kinds, offsets, ends }: BodyExtension): { joints: Vector3[]; ends: Vector3[] } {
  const joints: Vector3[] = [];
  const chest = kinds.lastIndexOf("spine");
  kinds.forEach((kind, joint) => {
    const parent = kind === "spine" ? joint - 1 : chest;
    joints.push(new Vector3().fromArray(offsets, joint * 3).add(joints[parent] ?? new Vector3()));
  });
  return {
    joints,
    ends: (["neck", "left clavicle", "right clavicle"] as const).map((kind, end) => {
      const carrier = kinds.includes(kind) ? kinds.indexOf(kind) : chest;
      return new Vector3().fromArray(ends, end * 3).add(joints[carrier] ?? new Vector3());
    }),
  };
}
