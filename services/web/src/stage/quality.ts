/** How much the stage draws, stepped down where frames come slowly. Pure: it is told the frame times. */

export interface Quality {
  /** Share of the pixel ratio. */
  sharpness: number;
  reflection: boolean;
  shadows: boolean;
  /** The figure without lacquer and grain. */
  plain: boolean;
}

export const QUALITIES: readonly Quality[] = [
  { sharpness: 1, reflection: true, shadows: true, plain: false },
  { sharpness: 0.75, reflection: true, shadows: true, plain: false },
  { sharpness: 0.6, reflection: false, shadows: true, plain: false },
  { sharpness: 0.5, reflection: false, shadows: false, plain: true },
  { sharpness: 0.35, reflection: false, shadows: false, plain: true },
];

/** Frames slower than this, several together, step down. Seconds: 24 frames a second. */
const SLOW = 1 / 24;
/** Frames looked at together; few, as where they are slow they also come seldom. */
const WINDOW = 6;
/** One frame this slow says enough, seconds; one slower still is a hidden tab or a sleeping machine. */
const CRAWL = 0.4;
const PAUSE = 8;
/** The first frames compile shaders and are no measure. */
const WARM_UP = 3;
/** Where to start on a machine that draws without a graphics processor. */
const SOFTWARE_LEVEL = 3;

export class QualityChoice {
  #level: number;
  #toSkip = WARM_UP;
  readonly #times: number[] = [];

  readonly #pinned: boolean;

  /** `renderer` is the graphics driver's name for itself; `pinned` keeps the best quality, however slow. */
  constructor(renderer: string, pinned: boolean) {
    this.#pinned = pinned;
    this.#level = !pinned && /swiftshader|llvmpipe|softpipe|software|basic render/i.test(renderer) ? SOFTWARE_LEVEL : 0;
  }

  get quality(): Quality {
    return QUALITIES[this.#level];
  }

  /** The next frames are no measure: the machine was busy with something else, or shaders are compiled anew. */
  restart(): void {
    this.#times.length = 0;
    this.#toSkip = WARM_UP;
  }

  /** Takes the seconds since the frame before; true when the quality has just been stepped down. Never steps up by itself. */
  frame(seconds: number): boolean {
    if (this.#pinned) return false;
    if (seconds > PAUSE) {
      this.#times.length = 0;
      return false;
    }
    if (this.#toSkip > 0) {
      this.#toSkip--;
      return false;
    }
    this.#times.push(seconds);
    if (this.#times.length < WINDOW && seconds < CRAWL) return false;
    const sorted = [...this.#times].sort((a, b) => a - b);
    this.#times.length = 0;
    const median = seconds < CRAWL ? sorted[WINDOW >> 1] : seconds;
    if (median <= SLOW || this.#level === QUALITIES.length - 1) return false;
    // Twice as slow as need be: two steps at once, so that a weak machine is not kept waiting.
    this.#level = Math.min(QUALITIES.length - 1, this.#level + (median > 3 * SLOW ? 2 : 1));
    this.#toSkip = 1;
    return true;
  }
}
