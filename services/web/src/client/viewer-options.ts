import type { Access } from "./access";
import type { SolverFactory } from "./marionette-solver";

/** Options of a viewer. */
export interface ViewerOptions {
  /** `ws(s)://.../stream` of a motion or a session. */
  url: string;
  /** Monotonic local clock, milliseconds; `performance.now` by default. */
  now?: () => number;
  /**
   * Factory of the solvers that predict the puppeteer's own limbs, by default the marionette. With null, and until the
   * solver is loaded, these limbs are shown as the session sends them.
   */
  solver?: SolverFactory | null;
  /** Server and credentials; those of the page by default. */
  access?: Access;
  /** Return true while nobody sees the stage; by default while the page is in the background. */
  isHidden?: () => boolean;
}
