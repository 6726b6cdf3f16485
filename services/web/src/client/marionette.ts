/** The marionette of one figure, its arm tables fetched from the IK service. */

import { readTable } from "../marionette/arm";
import { armProportions } from "../marionette/limbs";
import { PulledHand, PulledLeg } from "../marionette/pulled";
import type { Figure } from "../motion/skeleton";
import { type Access, pageAccess } from "./access";
import type { Solver } from "./solver";

/** The limbs of `figure`; `tables` are what `readTable` gave for the left and the right arm. */
export function marionette(figure: Figure, tables: readonly [Float64Array, Float64Array]): Solver {
  return {
    limbs: [
      new PulledHand(figure, 0, tables[0]), new PulledHand(figure, 1, tables[1]),
      new PulledLeg(figure, 2), new PulledLeg(figure, 3),
    ],
  };
}

/** The solver of `figure`, its tables from the service at `origin`; rejects with `ProblemError` where there are none. */
export async function fetchMarionette(figure: Figure, origin: string, access = pageAccess): Promise<Solver> {
  const tables = await Promise.all(([0, 1] as const).map((limb) => fetchTable(figure, limb, origin, access)));
  return marionette(figure, [tables[0], tables[1]]);
}

async function fetchTable(figure: Figure, limb: 0 | 1, origin: string, access: Access): Promise<Float64Array> {
  const { identity } = armProportions(figure, limb);
  const answer = await access.request(`${origin}/v1/arms/${identity}/table`);
  return readTable(new Uint8Array(await answer.arrayBuffer()));
}
