/** Who dances on the stage, as the stage, the strings and the hands on them know it: the puppet, or an avatar in its place. */
import { type Group, type Matrix4, Vector3 } from "three";
import type { Figure, Pose } from "../../motion/skeleton";
import { SIDES, SOLE_HEIGHT_M } from "./standard-figure";

export interface Performer {
  /** What is drawn, in the world's frame. */
  readonly group: Group;
  /** The lengths of the dancer that the stream tells of: whoever performs, pulls are told in its measures. */
  readonly figure: Figure;
  /** Size against the standard figure of 1.75 m. */
  readonly scale: number;
  /** World matrix of the pelvis, as it is shown: what the stage follows. */
  readonly root: Matrix4;
  /** Height of the floor that the lower foot would stand on, world metres. */
  readonly ground: number;
  /** Shows the reflection, which only the lacquer of the night has. */
  showsReflection: boolean;
  /** Draws with plain materials, for machines without a graphics processor. */
  usesSimpleMaterials: boolean;
  /** Takes a pose; `seconds` since the one before lets what hangs loose swing, 0 sets it still. */
  apply(pose: Pose, seconds: number): void;
  /** World place where a limb is seen and held (0 left hand, 1 right hand, 2 left knee, 3 right knee), written into `out`. */
  handle(limb: number, out: Vector3): Vector3;
  /** World matrix of a joint of the dancer that the stream tells of. */
  joint(name: string): Matrix4;
  /** Where the handle of the dancer that the stream tells of has to go, world, for this one's to come to `to`; into `out`. */
  toStreamedHandle(limb: number, to: Vector3, out: Vector3): Vector3;
  dispose(): void;
}

/** A dancer as far as its joints tell: world matrices by H-Anim's names, and the size against the standard figure. */
export type JointSource = Pick<Performer, "joint" | "scale">;

/** Places people hold, in the order of the limbs of the contract: joint, and place in its frame on the standard figure. */
const HANDLE_OFFSETS: readonly (readonly [joint: string, at: readonly [number, number, number]])[] = [
  ["l_wrist", [0.004, -0.075, 0.004]],
  ["r_wrist", [-0.004, -0.075, 0.004]],
  ["l_knee", [0, 0, 0.008]],
  ["r_knee", [0, 0, 0.008]],
];

/** World place of a limb's handle on a dancer's own joints, written into `out`. */
export function handlePosition({ joint, scale }: JointSource, limb: number, out: Vector3): Vector3 {
  const [name, at] = HANDLE_OFFSETS[limb];
  return out
    .set(...at)
    .multiplyScalar(scale)
    .applyMatrix4(joint(name));
}

/** Height of the floor that the lower foot would stand on: ball or heel, less the sole. `ankleHeight` is the ankle's over the ball at rest, metres. */
export function floorHeight({ joint, scale }: JointSource, ankleHeight: number): number {
  const at = new Vector3();
  let lowest = Infinity;
  for (const { side } of SIDES) {
    const ball = at.setFromMatrixPosition(joint(`${side}_midtarsal`)).y;
    // under the ankle, as high as the ball of the foot is at rest
    const heel = at.set(0, -ankleHeight, -0.045 * scale).applyMatrix4(joint(`${side}_ankle`)).y;
    lowest = Math.min(lowest, ball, heel);
  }
  return lowest - SOLE_HEIGHT_M * scale;
}
