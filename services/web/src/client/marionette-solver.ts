/** Solver of a figure's four limbs, with the bend tables of its arms from the IK service. */

import { parseBendTable } from "../marionette/arm";
import { ControlledHand, ControlledLeg, type ControlledLimb } from "../marionette/controlled-limb";
import { armProportions } from "../marionette/limb-rig";
import type { Figure } from "../motion/skeleton";
import { type Access, pageAccess } from "./access";

/** Four limbs of a figure, in the order of the contract, each with its state. */
export interface LimbSolver {
  readonly limbs: readonly ControlledLimb[];
}

/** Function that creates the solver of a figure; `origin` is the HTTP origin of the stream, for data to be fetched. */
export type SolverFactory = (figure: Figure, origin: string) => LimbSolver | Promise<LimbSolver>;

/** Create the solver of `figure`; `tables` are the parsed bend tables of the left and the right arm. */
export function createMarionetteSolver(figure: Figure, tables: readonly [Float64Array, Float64Array]): LimbSolver {
  return {
    limbs: [
      new ControlledHand(figure, 0, tables[0]),
      new ControlledHand(figure, 1, tables[1]),
      new ControlledLeg(figure, 2),
      new ControlledLeg(figure, 3),
    ],
  };
}

/**
 * Fetch the bend tables of `figure` from the IK service at `origin`, and create its solver.
 *
 * @throws ProblemError if the service is unreachable or has no tables for the figure
 */
export async function fetchMarionetteSolver(figure: Figure, origin: string, access = pageAccess): Promise<LimbSolver> {
  const [left, right] = await Promise.all(([0, 1] as const).map((limb) => fetchTable(figure, limb, origin, access)));
  return createMarionetteSolver(figure, [left, right]);
}

async function fetchTable(figure: Figure, limb: 0 | 1, origin: string, access: Access): Promise<Float64Array> {
  const { identity } = armProportions(figure, limb);
  const response = await access.request(`${origin}/v1/arms/${identity}/table`);
  return parseBendTable(new Uint8Array(await response.arrayBuffer()));
}
