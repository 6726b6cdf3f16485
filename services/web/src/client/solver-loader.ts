/** What a puppeteer's own limbs of one figure are solved with: made once for each figure that comes on. */

import type { Figure } from "../motion/skeleton";
import { type Access, pageAccess } from "./access";
import type { LimbSolver, SolverFactory } from "./solver";

/** The marionette, fetched by this access. It comes after the first pose: nobody pulls before. */
export function marionetteSolverFactory(access: Access): SolverFactory {
  return async (figure, origin) => (await import("./marionette-solver")).fetchMarionetteSolver(figure, origin, access);
}

export class SolverLoader {
  /** Null until it is there. */
  solver: LimbSolver | null = null;
  private isLoading = false;

  /**
   * @param figure whose limbs they are
   * @param origin of the server, `http(s)://...`
   * @param factory makes a figure's; null where there is to be none
   */
  constructor(
    private readonly figure: Figure,
    private readonly origin: string,
    private readonly factory: SolverFactory | null = marionetteSolverFactory(pageAccess),
  ) {}

  /** Makes it, unless it is there or being made. A failure is told, and tried again with the next call. */
  load(): void {
    const { figure, origin, factory: solverOf } = this;
    if (this.solver || this.isLoading || !solverOf) return;
    this.isLoading = true;
    void Promise.resolve()
      .then(() => solverOf(figure, origin))
      .then(
        (solver) => void (this.solver = solver),
        (error: unknown) => console.warn("your own limbs follow with the session's delay: no arm tables.", error),
      )
      .then(() => void (this.isLoading = false));
  }
}
