/**
 * Fingers of a performer, beside the figure's channels (`proto/codec.md`, 2.18). It computes what `motion/hands.py`
 * does in Python, where the model is described.
 */

import { fromRotationVector, multiply, type Numbers, rotate } from "./rotation";
import { JOINTS, type WorldTransforms } from "./skeleton";

export const FINGERS: readonly string[] = ["thumb", "index", "middle", "ring", "little"];
/** Chains of joints: the fingers of the left hand, thumb first, then those of the right. */
export const CHAIN_COUNT = 2 * FINGERS.length;
export const MAX_CHAIN_JOINTS = 3;
const THUMB_NAMES = ["carpometacarpal_1", "metacarpophalangeal_1", "carpal_interphalangeal_1"];
const FINGER_NAMES = ["metacarpophalangeal", "carpal_proximal_interphalangeal", "carpal_distal_interphalangeal"];
const VRM_THUMB_SEGMENTS = ["Metacarpal", "Proximal", "Distal"];
const VRM_FINGER_SEGMENTS = ["Proximal", "Intermediate", "Distal"];

/** H-Anim 2 names of the joints of each chain, from the wrist outwards. */
export const HANIM_NAMES: readonly (readonly string[])[] = ["l", "r"].flatMap((side) =>
  FINGERS.map((_, finger) =>
    (finger === 0 ? THUMB_NAMES : FINGER_NAMES.map((name) => `${name}_${finger + 1}`)).map((name) => `${side}_${name}`),
  ),
);
/** VRM 1.0 names of the joints of each chain. */
export const VRM_NAMES: readonly (readonly string[])[] = ["left", "right"].flatMap((side) =>
  FINGERS.map((finger, index) =>
    (index === 0 ? VRM_THUMB_SEGMENTS : VRM_FINGER_SEGMENTS).map(
      (segment) => `${side}${finger[0].toUpperCase()}${finger.slice(1)}${segment}`,
    ),
  ),
);
/** Wrist of each hand: its joint of the figure. */
export const WRISTS: readonly number[] = [JOINTS.indexOf("l_wrist"), JOINTS.indexOf("r_wrist")];
/** Directions of a thumb and of a finger at rest, in the frame of the wrist. */
export const THUMB_DIRECTION: readonly number[] = [0, -Math.SQRT1_2, Math.SQRT1_2];
export const FINGER_DIRECTION: readonly number[] = [0, -1, 0];

/**
 * Joints of a performer's fingers, E in all, in the order of their chains, each from the wrist outwards. Lengths are in
 * metres.
 */
export interface Hands {
  /** Joints of each of the ten chains, 0..3. */
  readonly counts: readonly number[];
  /** Positions [10][3] of the first joints from the wrist. */
  readonly bases: Float64Array;
  /** Lengths [10][3] of the bones after each joint. */
  readonly lengths: Float64Array;
}

/** Rotation vectors [E][3] of the joints of `hands` in the frames of those before them, radians. */
export interface HandsPose {
  readonly hands: Hands;
  readonly values: Float64Array;
}

/** Return the chain of each joint and its place in the chain. */
export function chainJoints({ counts }: Pick<Hands, "counts">): [chain: number, place: number][] {
  return counts.flatMap((count, chain) =>
    Array.from({ length: count }, (_, place): [number, number] => [chain, place]),
  );
}

/** Return the direction of a chain at rest. */
export function chainDirection(chain: number): readonly number[] {
  return chain % FINGERS.length === 0 ? THUMB_DIRECTION : FINGER_DIRECTION;
}

/** World positions [E][3], metres, and orientations [E][4] of the joints of the fingers. */
export interface HandsTransforms {
  readonly positions: Float64Array;
  readonly orientations: Float64Array;
}

const turn = new Float64Array(4);
const offset = new Float64Array(3);

/** Write the world transforms of the fingers into `out` and return it; `world` has those of the wrists. */
export function poseHands({ hands, values }: HandsPose, world: WorldTransforms, out: HandsTransforms): HandsTransforms {
  const { positions, orientations } = out;
  let joint = 0;
  hands.counts.forEach((count, chain) => {
    const wrist = WRISTS[Math.floor(chain / FINGERS.length)];
    const direction = chainDirection(chain);
    let places: Numbers = world.positions;
    let turns: Numbers = world.orientations;
    let before = wrist;
    offset.set(hands.bases.subarray(chain * 3, chain * 3 + 3));
    for (let place = 0; place < count; place++, joint++) {
      rotate(positions, joint * 3, turns, before * 4, offset, 0);
      for (let i = 0; i < 3; i++) positions[joint * 3 + i] += places[before * 3 + i];
      fromRotationVector(turn, 0, values[joint * 3], values[joint * 3 + 1], values[joint * 3 + 2]);
      multiply(orientations, joint * 4, turns, before * 4, turn, 0);
      for (let i = 0; i < 3; i++) offset[i] = hands.lengths[chain * MAX_CHAIN_JOINTS + place] * direction[i];
      [places, turns, before] = [positions, orientations, joint];
    }
  });
  return out;
}
