/** Rendering quality that follows what the machine can draw. Pure: frame times are arguments. */

export interface Quality {
  /** Share of the pixel ratio. */
  pixelRatioScale: number;
  reflection: boolean;
  shadows: boolean;
  /** Draws the figure without lacquer and grain. */
  simpleMaterials: boolean;
}

export const QUALITY_LEVELS: readonly Quality[] = [
  { pixelRatioScale: 1, reflection: true, shadows: true, simpleMaterials: false },
  { pixelRatioScale: 0.75, reflection: true, shadows: true, simpleMaterials: false },
  { pixelRatioScale: 0.6, reflection: false, shadows: true, simpleMaterials: false },
  { pixelRatioScale: 0.5, reflection: false, shadows: false, simpleMaterials: true },
  { pixelRatioScale: 0.35, reflection: false, shadows: false, simpleMaterials: true },
];

/** The quality is reduced if the median frame is slower than this, in seconds (24 frames per second). */
const SLOW_FRAME_S = 1 / 24;
/** The quality may rise if the median frame is faster than this, in seconds (27 frames per second). */
const FAST_FRAME_S = 1 / 27;
/** Frames per median; few, since slow frames are also rare. */
const WINDOW_FRAMES = 6;
/**
 * A single frame this slow reduces the quality, in seconds. An even longer one is a page in the background or a
 * suspended machine.
 */
const VERY_SLOW_FRAME_S = 0.4;
const PAUSE_S = 8;
/** The first frames compile shaders and are not measured. */
const WARM_UP_FRAMES = 3;
/** Time of fast frames before the next better level is tried, in seconds. */
const FIRST_TRIAL_S = 10;
/** A level that turned out too slow is tried again after twice the time, at most after this, in seconds. */
const MAX_TRIAL_S = 320;
/** A better level that was fast for this long is kept, in seconds. */
const TRIAL_DURATION_S = 10;
/** Best level on a machine without a graphics processor. */
const SOFTWARE_LEVEL = 3;

/**
 * Chooses the quality by the time between frames. How much time a frame leaves is not known, since frames wait for the
 * display: a better level is tried, and given up if it is too slow.
 */
export class AdaptiveQuality {
  readonly #pinned: boolean;
  readonly #best: number;
  #level: number;
  #framesToSkip = WARM_UP_FRAMES;
  readonly #frameTimes: number[] = [];
  /** Seconds of fast frames at this level. */
  #fastS = 0;
  #trialAfterS = FIRST_TRIAL_S;
  #isTrial = false;

  /** `renderer` is the name of the graphics driver; `pinned` keeps the best quality, however slow. */
  constructor(renderer: string, pinned: boolean) {
    this.#pinned = pinned;
    this.#best = !pinned && /swiftshader|llvmpipe|softpipe|software|basic render/i.test(renderer) ? SOFTWARE_LEVEL : 0;
    this.#level = this.#best;
  }

  get quality(): Quality {
    return QUALITY_LEVELS[this.#level];
  }

  /** Skip the next frames: the machine was busy with something else, or shaders are compiled again. */
  restart(): void {
    this.#frameTimes.length = 0;
    this.#framesToSkip = WARM_UP_FRAMES;
  }

  /** Add the seconds since the last frame. Return whether the quality has changed. */
  addFrameTime(seconds: number): boolean {
    if (this.#pinned) return false;
    if (seconds > PAUSE_S) {
      this.#frameTimes.length = 0;
      return false;
    }
    if (this.#framesToSkip > 0) {
      this.#framesToSkip--;
      return false;
    }
    this.#frameTimes.push(seconds);
    if (this.#frameTimes.length < WINDOW_FRAMES && seconds < VERY_SLOW_FRAME_S) return false;
    const sorted = [...this.#frameTimes].sort((a, b) => a - b);
    const windowS = sorted.reduce((sum, time) => sum + time, 0);
    this.#frameTimes.length = 0;
    const median = seconds < VERY_SLOW_FRAME_S ? sorted[WINDOW_FRAMES >> 1] : seconds;
    if (median > SLOW_FRAME_S) return this.#reduce(median);
    if (median < FAST_FRAME_S) this.#fastS += windowS;
    return this.#raise();
  }

  #reduce(median: number): boolean {
    if (this.#isTrial) this.#trialAfterS = Math.min(2 * this.#trialAfterS, MAX_TRIAL_S);
    // At a third of the frame rate, reduce by two levels at once, so that a weak machine recovers sooner.
    const steps = median > 3 * SLOW_FRAME_S && !this.#isTrial ? 2 : 1;
    return this.#changeLevel(Math.min(QUALITY_LEVELS.length - 1, this.#level + steps), false);
  }

  /** Keep a level that has proved fast, and try the next better one when it is time. */
  #raise(): boolean {
    if (this.#isTrial && this.#fastS >= TRIAL_DURATION_S) {
      this.#isTrial = false;
      this.#trialAfterS = FIRST_TRIAL_S;
    }
    return this.#fastS >= this.#trialAfterS && this.#changeLevel(Math.max(this.#best, this.#level - 1), true);
  }

  #changeLevel(level: number, isTrial: boolean): boolean {
    this.#fastS = 0;
    if (level === this.#level) return false;
    this.#isTrial = isTrial;
    const recompiles = QUALITY_LEVELS[level].simpleMaterials !== this.quality.simpleMaterials;
    this.#level = level;
    this.#framesToSkip = recompiles ? WARM_UP_FRAMES : 1;
    return true;
  }
}
