/**
 * Lets a frame be drawn only when the one before is done. A browser queues frames and then stands still until the graphics
 * catch up; on a slow machine that would stop the network's timers too, and a held limb would be taken for lost.
 */
export class FrameFence {
  readonly #context: WebGL2RenderingContext;
  #fence: WebGLSync | null = null;

  constructor(context: WebGL2RenderingContext) {
    this.#context = context;
  }

  /** Whether the frame before has been drawn, and one can be. */
  get isReady(): boolean {
    const gl = this.#context;
    if (gl.isContextLost()) return false;
    if (!this.#fence) return true;
    if (gl.getSyncParameter(this.#fence, gl.SYNC_STATUS) !== gl.SIGNALED) return false;
    gl.deleteSync(this.#fence);
    this.#fence = null;
    return true;
  }

  /** The context was lost and is there again: what was waited for went with it. */
  reset(): void {
    this.#fence = null;
  }

  /** Call right after drawing. */
  insert(): void {
    const gl = this.#context;
    this.#fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
  }
}
