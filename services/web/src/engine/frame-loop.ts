/**
 * Loop of animation frames. A frame for which the graphics processor was not ready is drawn as soon as it is: the next
 * callback of the display may be most of its interval away.
 */

/** Interval at which a graphics processor that was not ready is asked again, in milliseconds. */
const POLL_INTERVAL_MS = 2;

export class FrameLoop {
  #animationFrame = 0;
  #timer: ReturnType<typeof setTimeout> | undefined;

  /** Call `draw` for each frame from now on. `isLate` tells whether its last call had to wait, and still has to. */
  constructor(
    private readonly draw: () => void,
    private readonly isLate: () => boolean,
  ) {
    this.#request();
  }

  stop(): void {
    cancelAnimationFrame(this.#animationFrame);
    clearTimeout(this.#timer);
  }

  #request(): void {
    this.#animationFrame = requestAnimationFrame(() => {
      clearTimeout(this.#timer);
      this.#request();
      this.draw();
      if (this.isLate()) this.#poll();
    });
  }

  #poll(): void {
    this.#timer = setTimeout(() => (this.isLate() ? this.#poll() : this.draw()), POLL_INTERVAL_MS);
  }
}
