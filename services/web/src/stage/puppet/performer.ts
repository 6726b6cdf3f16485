/** A performer as stage, strings and limb controls see it: the puppet, or an avatar in its place. */
import { type Camera, type Group, type Matrix4, type Scene, Vector3, type WebGLRenderer } from "three";
import type { StagedPose } from "../../motion/extension";
import type { Figure } from "../../motion/skeleton";
import type { Look } from "../scenery/look";
import { SIDES, SOLE_HEIGHT_M } from "./standard-figure";

export interface Performer {
  /** Drawn objects, in the world frame. */
  readonly group: Group;
  /** Limb lengths from the stream: pull targets are expressed in its measures, whoever performs. */
  readonly figure: Figure;
  /** Size relative to the standard figure of 1.75 m. */
  readonly scale: number;
  /** Height at rest from the soles to the top of head and hair, in metres. */
  readonly height: number;
  /** World matrix of the pelvis as drawn: the stage follows it. */
  readonly root: Matrix4;
  /** Height of the floor under the lower foot, in world metres. */
  readonly ground: number;
  /** Shows the reflection in the floor, which only the night look has. */
  showsReflection: boolean;
  /** Uses materials for machines without a graphics processor. */
  usesSimpleMaterials: boolean;
  /**
   * Apply a pose. `seconds` since the last one advances the swing of loose parts; 0 stops it. `blink` is how far the
   * eyes are closed, 0..1, if the pose says nothing of them.
   */
  apply(pose: StagedPose, seconds: number, blink?: number): void;
  /** Draw what the next frame needs beforehand. World matrices are up to date. */
  prepare?(renderer: WebGLRenderer, scene: Scene, camera: Camera, look: Look): void;
  /** Draw it again: the graphics context was lost. */
  invalidate?(): void;
  /** Write the world position of a limb's handle into `out` (0 left hand, 1 right hand, 2 left knee, 3 right knee). */
  handle(limb: number, out: Vector3): Vector3;
  /**
   * Write the world matrix of a hand as drawn into `out` (0 left, 1 right): the axes of its joint, which are those of
   * the stage while the figure is at rest, at a share of the way from the wrist to the tip.
   */
  hand(limb: number, share: number, out: Matrix4): Matrix4;
  /** Return the world matrix of a joint of the streamed figure. */
  joint(name: string): Matrix4;
  /** Write into `out` the world position of the streamed figure's handle that moves this performer's handle to `to`. */
  toStreamedHandle(limb: number, to: Vector3, out: Vector3): Vector3;
  dispose(): void;
}

/** Joints of a performer (world matrices by H-Anim name) and its size relative to the standard figure. */
export type JointSource = Pick<Performer, "joint" | "scale">;

/** Handles in the order of the contract's limbs: joint, and position in its frame on the standard figure. */
const HANDLE_OFFSETS: readonly (readonly [joint: string, at: readonly [number, number, number]])[] = [
  ["l_wrist", [0.004, -0.075, 0.004]],
  ["r_wrist", [-0.004, -0.075, 0.004]],
  ["l_knee", [0, 0, 0.008]],
  ["r_knee", [0, 0, 0.008]],
];

/** Write the world position of a limb's handle, from the performer's own joints, into `out`. */
export function handlePosition({ joint, scale }: JointSource, limb: number, out: Vector3): Vector3 {
  const [name, at] = HANDLE_OFFSETS[limb];
  return out
    .set(...at)
    .multiplyScalar(scale)
    .applyMatrix4(joint(name));
}

/**
 * Return the height of the floor under the lower foot: ball or heel, less the sole. `ankleHeight` is the height of the
 * ankle above the ball at rest, in metres.
 */
export function floorHeight({ joint, scale }: JointSource, ankleHeight: number): number {
  const at = new Vector3();
  let lowest = Infinity;
  for (const { side } of SIDES) {
    const ball = at.setFromMatrixPosition(joint(`${side}_midtarsal`)).y;
    // The heel is under the ankle, as high as the ball of the foot at rest.
    const heel = at.set(0, -ankleHeight, -0.045 * scale).applyMatrix4(joint(`${side}_ankle`)).y;
    lowest = Math.min(lowest, ball, heel);
  }
  return lowest - SOLE_HEIGHT_M * scale;
}
