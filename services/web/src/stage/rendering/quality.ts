/** Rendering quality, reduced when frames are slow. Pure: frame times are arguments. */

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
/** Initial level on a machine without a graphics processor. */
const SOFTWARE_LEVEL = 3;

export class AdaptiveQuality {
  #level: number;
  #framesToSkip = WARM_UP_FRAMES;
  readonly #frameTimes: number[] = [];

  readonly #pinned: boolean;

  /** `renderer` is the name of the graphics driver; `pinned` keeps the best quality, however slow. */
  constructor(renderer: string, pinned: boolean) {
    this.#pinned = pinned;
    this.#level = !pinned && /swiftshader|llvmpipe|softpipe|software|basic render/i.test(renderer) ? SOFTWARE_LEVEL : 0;
  }

  get quality(): Quality {
    return QUALITY_LEVELS[this.#level];
  }

  /** Skip the next frames: the machine was busy with something else, or shaders are compiled again. */
  restart(): void {
    this.#frameTimes.length = 0;
    this.#framesToSkip = WARM_UP_FRAMES;
  }

  /** Add the seconds since the last frame. Return whether the quality was reduced. It is never raised automatically. */
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
    this.#frameTimes.length = 0;
    const median = seconds < VERY_SLOW_FRAME_S ? sorted[WINDOW_FRAMES >> 1] : seconds;
    if (median <= SLOW_FRAME_S || this.#level === QUALITY_LEVELS.length - 1) return false;
    // At a third of the frame rate, reduce by two levels at once, so that a weak machine recovers sooner.
    this.#level = Math.min(QUALITY_LEVELS.length - 1, this.#level + (median > 3 * SLOW_FRAME_S ? 2 : 1));
    this.#framesToSkip = 1;
    return true;
  }
}
