/** Rendering quality that follows what the machine can draw. Pure: frame times are arguments. */

export interface Quality {
  /** Share of the pixel ratio. */
  pixelRatioScale: number;
  reflection: boolean;
  shadows: boolean;
  /** Draws the figure without lacquer and grain. */
  simpleMaterials: boolean;
}

/** Quality of pictures, of a still stage and of a machine that is fast enough. */
export const BEST_QUALITY: Quality = { pixelRatioScale: 1, reflection: true, shadows: true, simpleMaterials: false };
const WITHOUT_REFLECTION: Quality = { ...BEST_QUALITY, reflection: false };
const SIMPLE: Quality = { pixelRatioScale: 1, reflection: false, shadows: false, simpleMaterials: true };

/** Levels with a graphics processor, from the best: first fewer pixels, then less detail, in small steps. */
export const GRAPHICS_LEVELS: readonly Quality[] = [
  BEST_QUALITY,
  { ...BEST_QUALITY, pixelRatioScale: 0.9 },
  { ...BEST_QUALITY, pixelRatioScale: 0.8 },
  { ...WITHOUT_REFLECTION, pixelRatioScale: 0.8 },
  { ...WITHOUT_REFLECTION, pixelRatioScale: 0.7 },
  { ...WITHOUT_REFLECTION, pixelRatioScale: 0.6 },
  { ...SIMPLE, pixelRatioScale: 0.7 },
  { ...SIMPLE, pixelRatioScale: 0.6 },
];
/** Levels without a graphics processor. */
export const SOFTWARE_LEVELS: readonly Quality[] = [1, 0.9, 0.8, 0.75, 0.7, 0.6].map((pixelRatioScale) => ({
  ...SIMPLE,
  pixelRatioScale,
}));
/** Level that software rendering starts with. */
const FIRST_SOFTWARE_LEVEL = 3;

/** Frame times that are aimed at, in seconds. */
const GRAPHICS_TARGET_S = 1 / 60;
const SOFTWARE_TARGET_S = 1 / 30;
/**
 * In software, a picture of at most this share of the resolution is kept at a frame time of 0.05 s: a coarser one looks
 * worse than one that moves less smoothly.
 */
const CLEAN_SCALE = 0.75;
const CLEAN_TARGET_S = 1 / 25;
/**
 * Interval of the slowest displays, in seconds: browsers that save energy draw 30 frames per second. A longer one is
 * the machine's.
 */
const SLOWEST_DISPLAY_S = 1 / 30;
/** The quality is reduced if the median frame takes longer than this multiple of the target. */
const SLOW = 1.25;
/**
 * The quality may rise if the median frame takes less than this multiple of the target. Below the clean picture, that of
 * a frame which is not slow suffices: only the trial shows if the machine was slow for a while.
 */
const FAST = 1.11;
/** Least frames per median; few, since slow frames are also rare. */
const WINDOW_FRAMES = 6;
/**
 * Least duration of the frames per median in software, in seconds: there the same processors decode, run scripts and
 * draw the page, which takes some frames in a row the time of two.
 */
const SOFTWARE_WINDOW_S = 2;
/**
 * A single frame this slow reduces the quality, in seconds. An even longer one is a page in the background or a
 * suspended machine.
 */
const VERY_SLOW_FRAME_S = 0.4;
const PAUSE_S = 8;
/** The first frames compile shaders and are not measured. */
const WARM_UP_FRAMES = 3;
/** Time of fast frames before the next better level is tried, in seconds. */
const FIRST_TRIAL_S = 5;
/** A level that turned out too slow is tried again after twice the time, at most after this, in seconds. */
const MAX_TRIAL_S = 320;
/** A better level that was fast for this long is kept, in seconds. */
const TRIAL_DURATION_S = 5;
/**
 * Chooses the quality by the time between frames. How much time a frame leaves is not known, since frames wait for the
 * display: a better level is tried, and given up if it is too slow.
 */
export class AdaptiveQuality {
  readonly #isPinned: boolean;
  readonly #levels: readonly Quality[];
  readonly #isSoftware: boolean;
  #level: number;
  #framesToSkip = WARM_UP_FRAMES;
  readonly #frameTimes: number[] = [];
  /** Seconds of fast frames at this level. */
  #fastS = 0;
  #trialAfterS = FIRST_TRIAL_S;
  #isTrial = false;

  /** `renderer` is the name of the graphics driver; `pinned` keeps the best quality, however slow. */
  constructor(renderer: string, pinned: boolean) {
    this.#isSoftware = !pinned && /swiftshader|llvmpipe|softpipe|software|basic render/i.test(renderer);
    this.#isPinned = pinned;
    this.#levels = this.#isSoftware ? SOFTWARE_LEVELS : GRAPHICS_LEVELS;
    this.#level = this.#isSoftware ? FIRST_SOFTWARE_LEVEL : 0;
  }

  get quality(): Quality {
    return this.#levels[this.#level];
  }

  /** Quality of a stage that stands still. */
  get bestQuality(): Quality {
    return this.#levels[0];
  }

  /** Skip the next frames: the machine was busy with something else, or shaders are compiled again. */
  restart(): void {
    this.#frameTimes.length = 0;
    this.#framesToSkip = WARM_UP_FRAMES;
  }

  /**
   * Add the seconds since the last frame. `displayS` is the interval at which the display lets frames be drawn: no
   * quality makes them faster. Return whether the quality has changed.
   */
  addFrameTime(seconds: number, displayS = 0): boolean {
    if (this.#isPinned) return false;
    if (seconds > PAUSE_S) {
      this.#frameTimes.length = 0;
      return false;
    }
    if (this.#framesToSkip > 0) {
      this.#framesToSkip--;
      return false;
    }
    this.#frameTimes.push(seconds);
    const sorted = [...this.#frameTimes].sort((a, b) => a - b);
    const windowS = sorted.reduce((sum, time) => sum + time, 0);
    const isComplete = sorted.length >= WINDOW_FRAMES && (!this.#isSoftware || windowS >= SOFTWARE_WINDOW_S);
    if (!isComplete && seconds < VERY_SLOW_FRAME_S) return false;
    this.#frameTimes.length = 0;
    const median = seconds < VERY_SLOW_FRAME_S ? sorted[sorted.length >> 1] : seconds;
    const targetS = this.#targetS(this.#level, displayS);
    if (median > SLOW * targetS) return this.#reduce(median / targetS);
    const isCoarse = this.#isSoftware && this.quality.pixelRatioScale < CLEAN_SCALE;
    const fast = isCoarse ? SLOW : FAST;
    if (median < fast * this.#targetS(Math.max(0, this.#level - 1), displayS)) this.#fastS += windowS;
    return this.#raise();
  }

  /** Return the frame time that is aimed at in a level. */
  #targetS(level: number, displayS: number): number {
    const target = !this.#isSoftware
      ? GRAPHICS_TARGET_S
      : this.#levels[level].pixelRatioScale <= CLEAN_SCALE
        ? CLEAN_TARGET_S
        : SOFTWARE_TARGET_S;
    return Math.max(target, Math.min(displayS, SLOWEST_DISPLAY_S));
  }

  /** `slowness` is the frame time as a multiple of the target. */
  #reduce(slowness: number): boolean {
    if (this.#isTrial) this.#trialAfterS = Math.min(2 * this.#trialAfterS, MAX_TRIAL_S);
    // Several levels at once, so that a weak machine recovers sooner.
    const steps = this.#isTrial ? 1 : slowness > 4 ? 4 : slowness > 2 ? 2 : 1;
    return this.#changeLevel(Math.min(this.#levels.length - 1, this.#level + steps), false);
  }

  /** Keep a level that has proved fast, and try the next better one when it is time. */
  #raise(): boolean {
    if (this.#isTrial && this.#fastS >= TRIAL_DURATION_S) {
      this.#isTrial = false;
      this.#trialAfterS = FIRST_TRIAL_S;
    }
    return this.#fastS >= this.#trialAfterS && this.#changeLevel(Math.max(0, this.#level - 1), true);
  }

  #changeLevel(level: number, isTrial: boolean): boolean {
    this.#fastS = 0;
    if (level === this.#level) return false;
    this.#isTrial = isTrial;
    const recompiles = this.#levels[level].simpleMaterials !== this.quality.simpleMaterials;
    this.#level = level;
    this.#framesToSkip = recompiles ? WARM_UP_FRAMES : 1;
    return true;
  }
}
