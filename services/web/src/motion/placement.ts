/**
 * Who dances, and where: each dance is told about the middle of a stage of its own, and stands in a place of the one stage that
 * all performers share (`proto/SPEC.md`, Track `motion`).
 */

import { multiply, rotate } from "./rotation";
import type { Figure, Pose } from "./skeleton";
import { fromCoordinateAxis } from "./vector";

/** Turned by `turn` radians about y, from z towards x, and then moved by `x` and `z` metres. */
export interface Placement {
  readonly x: number;
  readonly z: number;
  readonly turn: number;
}

/** A dancer of a motion. */
export interface StagedPerformer {
  readonly figure: Figure;
  /** Where the dance faces over its length as it stands on the stage, radians about y from z towards x. */
  readonly front: number;
  readonly placement: Placement;
}

/** Where a dance stands of which nothing else is said. */
export const STAGE_CENTRE: Placement = { x: 0, z: 0, turn: 0 };

const turnRotation = new Float64Array(4);

/** Brings `pose` from the dance's own stage to its `place`; returned. */
export function applyPlacement(pose: Pose, { x, z, turn }: Placement): Pose {
  const { root, rotations } = pose;
  if (turn !== 0) {
    fromCoordinateAxis(turnRotation, 0, 1, turn);
    rotate(root, 0, turnRotation, 0, root, 0);
    multiply(rotations, 0, turnRotation, 0, rotations, 0);
  }
  root[0] += x;
  root[2] += z;
  return pose;
}
