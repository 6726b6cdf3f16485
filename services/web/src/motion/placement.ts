/**
 * Placement of performers: each motion has its own coordinates, and a placement moves them to the shared stage
 * (`proto/messages.md`, 3.2).
 */

import { multiply, rotate } from "./rotation";
import type { Figure, Pose } from "./skeleton";
import { fromCoordinateAxis } from "./vector";

/** Rotation by `turn` radians about y, from z towards x, then translation by `x` and `z` metres. */
export interface Placement {
  readonly x: number;
  readonly z: number;
  readonly turn: number;
}

/** A performer of a motion. */
export interface StagedPerformer {
  readonly figure: Figure;
  /** Mean facing of the motion as placed on the stage, in radians about y from z towards x. */
  readonly front: number;
  readonly placement: Placement;
}

/** Default placement. */
export const STAGE_CENTRE: Placement = { x: 0, z: 0, turn: 0 };

const turnRotation = new Float64Array(4);

/** Transform `pose` from the motion's own stage to its placement, in place, and return it. */
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
