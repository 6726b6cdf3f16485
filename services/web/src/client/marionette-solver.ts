/** The marionette of one figure, its arm tables fetched from the IK service. */

import { parseBendTable } from "../marionette/arm";
import { ControlledHand, ControlledLeg } from "../marionette/controlled-limb";
import { armProportions } from "../marionette/limb-rig";
import type { Figure } from "../motion/skeleton";
import { type Access, pageAccess } from "./access";
import type { LimbSolver } from "./solver";

/** The limbs of `figure`; `tables` are what `readTable` gave for the left and the right arm. */
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

/** The solver of `figure`, its tables from the service at `origin`; rejects with `ProblemError` where there are none. */
export async function fetchMarionetteSolver(figure: Figure, origin: string, access = pageAccess): Promise<LimbSolver> {
  const tables = await Promise.all(([0, 1] as const).map((limb) => fetchTable(figure, limb, origin, access)));
  return createMarionetteSolver(figure, [tables[0], tables[1]]);
}

async function fetchTable(figure: Figure, limb: 0 | 1, origin: string, access: Access): Promise<Float64Array> {
  const { identity } = armProportions(figure, limb);
  const answer = await access.request(`${origin}/v1/arms/${identity}/table`);
  return parseBendTable(new Uint8Array(await answer.arrayBuffer()));
}
