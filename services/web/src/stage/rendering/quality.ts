/** How much the stage draws, stepped down where frames come slowly. Pure: it is told the frame times. */

export interface Quality {
  /** Share of the pixel ratio. */
  pixelRatioScale: number;
  reflection: boolean;
  shadows: boolean;
  /** The figure without lacquer and grain. */
  simpleMaterials: boolean;
}

export const QUALITY_LEVELS: readonly Quality[] = [
  { pixelRatioScale: 1, reflection: true, shadows: true, simpleMaterials: false },
  { pixelRatioScale: 0.75, reflection: true, shadows: true, simpleMaterials: false },
  { pixelRatioScale: 0.6, reflection: false, shadows: true, simpleMaterials: false },
  { pixelRatioScale: 0.5, reflection: false, shadows: false, simpleMaterials: true },
  { pixelRatioScale: 0.35, reflection: false, shadows: false, simpleMaterials: true },
];

/** Frames slower than this, several together, step down. Seconds: 24 frames a second. */
const SLOW_FRAME_S = 1 / 24;
/** Frames looked at together; few, as where they are slow they also come seldom. */
const WINDOW_FRAMES = 6;
/** One frame this slow says enough, seconds; one slower still is a hidden tab or a sleeping machine. */
const VERY_SLOW_FRAME_S = 0.4;
const PAUSE_S = 8;
/** The first frames compile shaders and are no measure. */
const WARM_UP_FRAMES = 3;
/** Where to start on a machine that draws without a graphics processor. */
const SOFTWARE_LEVEL = 3;

export class AdaptiveQuality {
  #level: number;
  #framesToSkip = WARM_UP_FRAMES;
  readonly #frameTimes: number[] = [];

  readonly #pinned: boolean;

  /** `renderer` is the graphics driver's name for itself; `pinned` keeps the best quality, however slow. */
  constructor(renderer: string, pinned: boolean) {
    this.#pinned = pinned;
    this.#level = !pinned && /swiftshader|llvmpipe|softpipe|software|basic render/i.test(renderer) ? SOFTWARE_LEVEL : 0;
  }

  get quality(): Quality {
    return QUALITY_LEVELS[this.#level];
  }

  /** The next frames are no measure: the machine was busy with something else, or shaders are compiled anew. */
  restart(): void {
    this.#frameTimes.length = 0;
    this.#framesToSkip = WARM_UP_FRAMES;
  }

  /** Takes the seconds since the frame before; true when the quality has just been stepped down. Never steps up by itself. */
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
    // Twice as slow as need be: two steps at once, so that a weak machine is not kept waiting.
    this.#level = Math.min(QUALITY_LEVELS.length - 1, this.#level + (median > 3 * SLOW_FRAME_S ? 2 : 1));
    this.#framesToSkip = 1;
    return true;
  }
}
