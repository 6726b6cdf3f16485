/**
 * Order of the page's start: the puppet first. The page around it, fonts, sound and other work wait for the scripts of
 * the stage or for the first frame, since they share its connection and, with software rendering, its processor.
 * Timeouts bound the wait if no motion or no stage arrives.
 */

/** Time after which the page loads although its stage is still loading over a slow connection. */
const PAGE_LOAD_TIMEOUT_MS = 2_000;
/** Time after which the page is shown without its stage. */
const STAGE_TIMEOUT_MS = 2_500;
/** Longest wait for the first frame after the stage is ready. */
const FIRST_FRAME_TIMEOUT_MS = 2_000;

export class StartupSequence {
  /** Resolves when the page around the stage shall be loaded. */
  readonly loadDue: Promise<void>;
  /** Resolves when the page around the stage shall be built: after the first frame, or if it is late or impossible. */
  readonly buildDue: Promise<void>;
  #setLoadDue: () => void = () => undefined;
  #setBuildDue: () => void = () => undefined;
  /** Callbacks that wait for the first frame; null after it. */
  #callbacks: (() => void)[] | null = [];
  #stageReady = false;
  #isStageLate = false;
  #isPageBuilt = false;

  /**
   * Start at once. The attribute `data-arriving` of `root` carries the state for the style sheet: `veiled` (as in the
   * page's markup) while only the seal is shown, empty while the page is shown without the stage, absent when
   * finished.
   */
  constructor(private readonly root: HTMLElement) {
    root.dataset["arriving"] = "veiled";
    this.loadDue = new Promise((resolve) => (this.#setLoadDue = resolve));
    this.buildDue = new Promise((resolve) => (this.#setBuildDue = resolve));
    setTimeout(() => this.loadPage(), PAGE_LOAD_TIMEOUT_MS);
    setTimeout(() => {
      this.#isStageLate = true;
      this.buildPage();
      this.#revealPage();
    }, STAGE_TIMEOUT_MS);
  }

  /** Call `callback` after the first frame, at once if it was drawn already. */
  runWhenFinished(callback: () => void): void {
    if (this.#callbacks) this.#callbacks.push(callback);
    else callback();
  }

  /** Load the page around the stage: the scripts of the stage no longer need the connection. */
  loadPage(): void {
    this.#setLoadDue();
  }

  /** Load and build the page around the stage, without waiting for the first frame. */
  buildPage(): void {
    this.loadPage();
    this.#setBuildDue();
  }

  /** Report that the stage is loaded. The first frame is expected soon. */
  onStageReady(): void {
    this.#stageReady = true;
    setTimeout(() => this.finish(), FIRST_FRAME_TIMEOUT_MS);
  }

  /** Report that the page around the stage is built. */
  onPageBuilt(): void {
    this.#isPageBuilt = true;
    this.#revealPage();
  }

  /** Reveal the page and run all waiting callbacks: the first frame was drawn, or there will be none. */
  finish(): void {
    this.buildPage();
    const callbacks = this.#callbacks;
    if (!callbacks) return;
    this.#callbacks = null;
    delete this.root.dataset["arriving"];
    for (const callback of callbacks) callback();
  }

  #revealPage(): void {
    if (!this.#callbacks || this.#stageReady) return;
    if (this.#isStageLate && this.#isPageBuilt) this.root.dataset["arriving"] = "";
  }
}
