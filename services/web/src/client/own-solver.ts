/** What a puppeteer's own limbs of one figure are solved with: made once for each figure that comes on. */

import type { Figure } from "../motion/skeleton";
import { type Access, pageAccess } from "./access";
import type { Solver, SolverOf } from "./solver";

/** The marionette, fetched by this access. It comes after the first pose: nobody pulls before. */
export function marionetteBy(access: Access): SolverOf {
  return async (figure, origin) => (await import("./marionette")).fetchMarionette(figure, origin, access);
}

export class OwnSolver {
  /** Null until it is there. */
  solver: Solver | null = null;
  private making = false;

  /**
   * @param figure whose limbs they are
   * @param origin of the server, `http(s)://...`
   * @param solverOf makes a figure's; null where there is to be none
   */
  constructor(private readonly figure: Figure, private readonly origin: string, private readonly solverOf: SolverOf | null = marionetteBy(pageAccess)) {}

  /** Makes it, unless it is there or being made. A failure is told, and tried again with the next call. */
  prepare(): void {
    const { figure, origin, solverOf } = this;
    if (this.solver || this.making || !solverOf) return;
    this.making = true;
    void Promise.resolve()
      .then(() => solverOf(figure, origin))
      .then(
        (solver) => void (this.solver = solver),
        (error: unknown) => console.warn("your own limbs follow with the session's delay: no arm tables.", error),
      )
      .then(() => void (this.making = false));
  }
}
