import { expect, test } from "vitest";
import { FrameFence } from "../../../src/stage/rendering/frame-fence";

/** The calls of a WebGL 2 context that the gate makes, over a queue this test drains by hand. */
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

test("opens when the frame before is drawn, and keeps no fence behind", () => {
  const queue = new Queue();
  const gate = new FrameFence(queue as unknown as WebGL2RenderingContext);
  expect(gate.isReady).toBe(true);
  gate.insert();
  expect([gate.isReady, gate.isReady]).toEqual([false, false]);
  queue.done = true;
  expect(gate.isReady).toBe(true);
  expect(queue.alive).toBe(0);
});

test("is shut while the context is lost, and not for good", () => {
  const queue = new Queue();
  const gate = new FrameFence(queue as unknown as WebGL2RenderingContext);
  gate.insert();
  queue.lost = true;
  queue.done = true;
  expect(gate.isReady).toBe(false);
  // a fence of the context before never says anything again
  [queue.lost, queue.done] = [false, false];
  expect(gate.isReady).toBe(false);
  gate.reset();
  expect(gate.isReady).toBe(true);
});
