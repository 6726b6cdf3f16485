/**
 * The puppet comes first. Until it is there only the seal is to be seen, and the page's fonts, its sound and whatever else can wait do,
 * as all come over the same line, and a machine that draws in software paints one after the other. Neither waits for a dance that
 * does not come, nor the page for a stage that is long on its way.
 */

/** The page shows itself if the stage is not ready after so long, milliseconds: it is on its way over a slow line. */
const STAGE_TIMEOUT_MS = 2_500;
/** From when the stage is ready nothing waits longer than this, milliseconds. */
const FIRST_FRAME_TIMEOUT_MS = 2_000;

export class StartupSequence {
  /** What waits; null once nothing does. */
  #callbacks: (() => void)[] | null = [];
  #stageReady = false;

  /**
   * Begins at once. `root` tells the style sheet of it in `data-arriving`: `veiled` while only the seal is to be seen, as
   * the page's own markup begins with, then empty.
   */
  constructor(private readonly root: HTMLElement) {
    root.dataset["arriving"] = "veiled";
    setTimeout(() => this.#revealPage(), STAGE_TIMEOUT_MS);
  }

  /** Done when the puppet is there: at once if it is. */
  runWhenFinished(callback: () => void): void {
    if (this.#callbacks) this.#callbacks.push(callback);
    else callback();
  }

  /** The stage is ready, and the puppet as good as there. */
  onStageReady(): void {
    this.#stageReady = true;
    setTimeout(() => this.finish(), FIRST_FRAME_TIMEOUT_MS);
  }

  /** The puppet is there, or never will be. */
  finish(): void {
    const waiting = this.#callbacks;
    if (!waiting) return;
    this.#callbacks = null;
    delete this.root.dataset["arriving"];
    for (const done of waiting) done();
  }

  #revealPage(): void {
    if (this.#callbacks && !this.#stageReady) this.root.dataset["arriving"] = "";
  }
}
