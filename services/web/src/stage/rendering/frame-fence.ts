/**
 * Fence that allows a new frame only after the last one is complete. A browser queues frames and then blocks until the
 * graphics processor catches up; on a slow machine that would also block the network timers, and a held limb would time
 * out.
 */
export class FrameFence {
  readonly #context: WebGL2RenderingContext;
  #fence: WebGLSync | null = null;

  constructor(context: WebGL2RenderingContext) {
    this.#context = context;
  }

  /** True if the last frame is complete and another can be drawn. */
  get isReady(): boolean {
    const gl = this.#context;
    if (gl.isContextLost()) return false;
    if (!this.#fence) return true;
    if (gl.getSyncParameter(this.#fence, gl.SYNC_STATUS) !== gl.SIGNALED) return false;
    gl.deleteSync(this.#fence);
    this.#fence = null;
    return true;
  }

  /** True if another frame can be drawn soon, and not yet. */
  get isPending(): boolean {
    return !this.#context.isContextLost() && !this.isReady;
  }

  /** Discard the fence after the context was lost and restored. */
  reset(): void {
    this.#fence = null;
  }

  /** Insert a fence. Call it right after drawing. */
  insert(): void {
    const gl = this.#context;
    this.#fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
  }
}
