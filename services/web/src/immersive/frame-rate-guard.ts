/** Decides whether a headset draws too slowly. Pure: frame times are arguments. */

/** Frames per median: few, if they take so long together, in seconds. */
const WINDOW_FRAMES = 24;
const MIN_WINDOW_FRAMES = 6;
const WINDOW_S = 1;
/** The first frames compile shaders and are not measured. */
const WARM_UP_FRAMES = 12;
/** Median frame time that is too long: a headset shows at least 72 frames per second, in seconds. */
const SLOW_FRAME_S = 1.25 / 72;

export class FrameRateGuard {
  readonly #times: number[] = [];
  #framesToSkip = WARM_UP_FRAMES;

  /** Add the seconds since the last frame. Return true once the median of the last ones is too long. */
  add(seconds: number): boolean {
    if (this.#framesToSkip > 0) {
      this.#framesToSkip--;
      return false;
    }
    this.#times.push(seconds);
    const { length } = this.#times;
    const windowS = this.#times.reduce((sum, time) => sum + time, 0);
    if (length < WINDOW_FRAMES && (length < MIN_WINDOW_FRAMES || windowS < WINDOW_S)) return false;
    const median = this.#times.sort((a, b) => a - b)[length >> 1];
    this.#times.length = 0;
    return median > SLOW_FRAME_S;
  }
}
