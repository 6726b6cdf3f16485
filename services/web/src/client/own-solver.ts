/** What a puppeteer's own limbs are solved with: made once for each figure that comes on. */

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
  private figure: Figure | null = null;

  /**
   * @param origin of the server, `http(s)://...`
   * @param solverOf makes a figure's; null where there is to be none
   */
  constructor(private readonly origin: string, private readonly solverOf: SolverOf | null = marionetteBy(pageAccess)) {}

  /** Makes `figure`'s, unless it is there. A failure is told, and tried again with the next call. */
  prepare(figure: Figure | null): void {
    const { origin, solverOf } = this;
    if (figure !== this.figure) this.solver = null;
    this.figure = figure;
    if (this.solver || !figure || !solverOf) return;
    void Promise.resolve()
      .then(() => solverOf(figure, origin))
      .then(
        (solver) => {
          // another motion may have come while it was made
          if (this.figure === figure) this.solver = solver;
        },
        (error: unknown) => console.warn("your own limbs follow with the session's delay: no arm tables.", error),
      );
  }
}
