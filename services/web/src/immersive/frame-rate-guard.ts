/** Decides whether a headset draws too slowly. Pure: frame times are arguments. */

/** Frames per median. */
const WINDOW_FRAMES = 24;
/** The first frames compile shaders and are not measured. */
const WARM_UP_FRAMES = 12;
/** Median frame time that is too long: a headset shows at least 72 frames per second, in seconds. */
const SLOW_FRAME_S = 1.25 / 72;
/** Longer intervals are pauses, in which the headset showed something else, in seconds. */
const PAUSE_S = 1;

export class FrameRateGuard {
  readonly #times: number[] = [];
  #framesToSkip = WARM_UP_FRAMES;

  /** Add the seconds since the last frame. Return true once the median of the last ones is too long. */
  add(seconds: number): boolean {
    if (seconds > PAUSE_S || this.#framesToSkip > 0) {
      this.#framesToSkip = Math.max(this.#framesToSkip - 1, 0);
      return false;
    }
    this.#times.push(seconds);
    if (this.#times.length < WINDOW_FRAMES) return false;
    const median = this.#times.sort((a, b) => a - b)[WINDOW_FRAMES >> 1];
    this.#times.length = 0;
    return median > SLOW_FRAME_S;
  }
}
