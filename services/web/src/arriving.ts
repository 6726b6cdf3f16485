/**
 * The puppet comes first. Until it is there only the seal is to be seen, and the page's fonts, its sound and whatever else can wait do,
 * as all come over the same line, and a machine that draws in software paints one after the other. Neither waits for a dance that
 * does not come, nor the page for a stage that is long on its way.
 */

/** The page shows itself if the stage is not ready after so long, milliseconds: it is on its way over a slow line. */
const NEAR = 2_500;
/** From when the stage is ready nothing waits longer than this, milliseconds. */
const LONGEST = 2_000;

export class Arriving {
  /** What waits; null once nothing does. */
  #waiting: (() => void)[] | null = [];
  #staged = false;

  /**
   * Begins at once. `root` tells the style sheet of it in `data-arriving`: `veiled` while only the seal is to be seen, as
   * the page's own markup begins with, then empty.
   */
  constructor(private readonly root: HTMLElement) {
    root.dataset["arriving"] = "veiled";
    setTimeout(() => this.#unveil(), NEAR);
  }

  /** Done when the puppet is there: at once if it is. */
  after(done: () => void): void {
    if (this.#waiting) this.#waiting.push(done);
    else done();
  }

  /** The stage is ready, and the puppet as good as there. */
  staged(): void {
    this.#staged = true;
    setTimeout(() => this.arrived(), LONGEST);
  }

  /** The puppet is there, or never will be. */
  arrived(): void {
    const waiting = this.#waiting;
    if (!waiting) return;
    this.#waiting = null;
    delete this.root.dataset["arriving"];
    for (const done of waiting) done();
  }

  #unveil(): void {
    if (this.#waiting && !this.#staged) this.root.dataset["arriving"] = "";
  }
}
