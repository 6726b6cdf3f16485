/** What a puppeteer's own limbs are moved by: the marionette of one figure. */

import type { ControlledLimb } from "../marionette/controlled-limb";
import type { Figure } from "../motion/skeleton";

/** The four limbs of a figure, in the order of the contract, with the memory of where they are. */
export interface LimbSolver {
  readonly limbs: readonly ControlledLimb[];
}

/** Makes the solver of a figure; what it needs may have to be fetched first, from the HTTP `origin` of the stream. */
export type SolverFactory = (figure: Figure, origin: string) => LimbSolver | Promise<LimbSolver>;
