import type { Access } from "./access";
import type { SolverFactory } from "./solver";

/** What a viewer watches, and with what. */
export interface ViewerOptions {
  /** `ws(s)://.../stream` of a motion or a session. */
  url: string;
  /** Local milliseconds, never running backwards. */
  now?: () => number;
  /**
   * Makes what a puppeteer's own limbs are solved with: the marionette, if nothing else is said. With null, and until it is
   * there, they are seen as everyone sees them.
   */
  solver?: SolverFactory | null;
  /** How it comes in at the server: this page's own, if nothing else is said. */
  access?: Access;
}
