import { expect, test } from "vitest";
import { FrameFence } from "../../../src/stage/rendering/frame-fence";

/** WebGL 2 context with a command queue that the test completes. */
class Queue {
  readonly SYNC_STATUS = 1;
  readonly SIGNALED = 2;
  readonly SYNC_GPU_COMMANDS_COMPLETE = 3;
  done = false;
  lost = false;
  alive = 0;
  fenceSync(): object {
    this.done = false;
    this.alive++;
    return {};
  }
  deleteSync(): void {
    this.alive--;
  }
  getSyncParameter(): number {
    return this.done ? this.SIGNALED : 0;
  }
  isContextLost(): boolean {
    return this.lost;
  }
  flush(): void {}
}

test("is ready once the last frame is complete, and deletes its fence", () => {
  const queue = new Queue();
  const fence = new FrameFence(queue as unknown as WebGL2RenderingContext);
  expect(fence.isReady).toBe(true);
  fence.insert();
  expect([fence.isReady, fence.isReady]).toEqual([false, false]);
  queue.done = true;
  expect(fence.isReady).toBe(true);
  expect(queue.alive).toBe(0);
});

test("is not ready while the context is lost, and recovers after a reset", () => {
  const queue = new Queue();
  const fence = new FrameFence(queue as unknown as WebGL2RenderingContext);
  fence.insert();
  queue.lost = true;
  queue.done = true;
  expect(fence.isReady).toBe(false);
  // A fence of the lost context never signals.
  [queue.lost, queue.done] = [false, false];
  expect(fence.isReady).toBe(false);
  fence.reset();
  expect(fence.isReady).toBe(true);
});
