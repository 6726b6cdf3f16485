/**
 * Who dances, and where: each dance is told about the middle of a stage of its own, and stands in a place of the one stage that
 * all performers share (`proto/SPEC.md`, Track `motion`).
 */

import { multiply, rotate } from "./rotation";
import type { Figure, Pose } from "./skeleton";
import { aboutAxis } from "./vector";

/** Turned by `turn` radians about y, from z towards x, and then moved by `x` and `z` metres. */
export interface Place {
  readonly x: number;
  readonly z: number;
  readonly turn: number;
}

/** A dancer of a motion. */
export interface PerformerTrack {
  readonly figure: Figure;
  /** Where the dance faces over its length as it stands on the stage, radians about y from z towards x. */
  readonly front: number;
  readonly place: Place;
}

/** Where a dance stands of which nothing else is said. */
export const MIDDLE: Place = { x: 0, z: 0, turn: 0 };

const turned = new Float64Array(4);

/** Brings `pose` from the dance's own stage to its `place`; returned. */
export function bring(pose: Pose, { x, z, turn }: Place): Pose {
  const { root, rotations } = pose;
  if (turn !== 0) {
    aboutAxis(turned, 0, 1, turn);
    rotate(root, 0, turned, 0, root, 0);
    multiply(rotations, 0, turned, 0, rotations, 0);
  }
  root[0] += x;
  root[2] += z;
  return pose;
}
