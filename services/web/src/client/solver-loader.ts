/** Loader of a figure's limb solver, which is not part of the page's first chunk. */

import type { Figure } from "../motion/skeleton";
import { type Access, pageAccess } from "./access";
import type { LimbSolver, SolverFactory } from "./marionette-solver";

/** Return a factory that imports the marionette and fetches its tables with `access`. */
export function marionetteSolverFactory(access: Access): SolverFactory {
  return async (figure, origin) => (await import("./marionette-solver")).fetchMarionetteSolver(figure, origin, access);
}

/** Loader of one figure's solver. */
export class SolverLoader {
  private loaded: LimbSolver | null = null;
  private isLoading = false;

  /**
   * @param figure figure of the limbs
   * @param origin origin of the server, `http(s)://...`
   * @param factory factory of the solver; null for none
   */
  constructor(
    private readonly figure: Figure,
    private readonly origin: string,
    private readonly factory: SolverFactory | null = marionetteSolverFactory(pageAccess),
  ) {}

  /** Solver, or null until it is loaded. */
  get solver(): LimbSolver | null {
    return this.loaded;
  }

  /** Start loading, unless it is loaded or in progress. A failure is logged, and the next call tries again. */
  load(): void {
    const { figure, origin, factory } = this;
    if (this.loaded || this.isLoading || !factory) return;
    this.isLoading = true;
    void Promise.resolve()
      .then(() => factory(figure, origin))
      .then(
        (solver) => void (this.loaded = solver),
        (error: unknown) =>
          console.warn("Limb solver not loaded: your limbs are shown with the delay of the session.", error),
      )
      .then(() => void (this.isLoading = false));
  }
}
