/** What a puppeteer's own limbs are moved by: the marionette of one figure. */

import type { Pulled } from "../marionette/pulled";
import type { Figure } from "../motion/skeleton";

/** The four limbs of a figure, in the order of the contract, with the memory of where they are. */
export interface Solver {
  readonly limbs: readonly Pulled[];
}

/** Makes the solver of a figure; what it needs may have to be fetched first, from the HTTP `origin` of the stream. */
export type SolverOf = (figure: Figure, origin: string) => Solver | Promise<Solver>;
