/**
 * Order of the page's start: the puppet first. Fonts, sound and other work wait for the first frame, since they share
 * its connection and, with software rendering, its processor. Timeouts bound the wait if no motion or no stage
 * arrives.
 */

/** Time after which the page is shown without its stage, which is still loading over a slow connection. */
const STAGE_TIMEOUT_MS = 2_500;
/** Longest wait for the first frame after the stage is ready. */
const FIRST_FRAME_TIMEOUT_MS = 2_000;

export class StartupSequence {
  /** Callbacks that wait for the first frame; null after it. */
  #callbacks: (() => void)[] | null = [];
  #stageReady = false;

  /**
   * Start at once. The attribute `data-arriving` of `root` carries the state for the style sheet: `veiled` (as in the
   * page's markup) while only the seal is shown, empty while the page is shown without the stage, absent when
   * finished.
   */
  constructor(private readonly root: HTMLElement) {
    root.dataset["arriving"] = "veiled";
    setTimeout(() => this.#revealPage(), STAGE_TIMEOUT_MS);
  }

  /** Call `callback` after the first frame, at once if it was drawn already. */
  runWhenFinished(callback: () => void): void {
    if (this.#callbacks) this.#callbacks.push(callback);
    else callback();
  }

  /** Report that the stage is loaded. The first frame is expected soon. */
  onStageReady(): void {
    this.#stageReady = true;
    setTimeout(() => this.finish(), FIRST_FRAME_TIMEOUT_MS);
  }

  /** Reveal the page and run all waiting callbacks: the first frame was drawn, or there will be none. */
  finish(): void {
    const callbacks = this.#callbacks;
    if (!callbacks) return;
    this.#callbacks = null;
    delete this.root.dataset["arriving"];
    for (const callback of callbacks) callback();
  }

  #revealPage(): void {
    if (this.#callbacks && !this.#stageReady) this.root.dataset["arriving"] = "";
  }
}
