import { expect, test } from "vitest";
import { FrameGate } from "../../src/stage/frame-gate";

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
  const gate = new FrameGate(queue as unknown as WebGL2RenderingContext);
  expect(gate.open).toBe(true);
  gate.close();
  expect([gate.open, gate.open]).toEqual([false, false]);
  queue.done = true;
  expect(gate.open).toBe(true);
  expect(queue.alive).toBe(0);
});

test("is shut while the context is lost, and not for good", () => {
  const queue = new Queue();
  const gate = new FrameGate(queue as unknown as WebGL2RenderingContext);
  gate.close();
  queue.lost = true;
  queue.done = true;
  expect(gate.open).toBe(false);
  // a fence of the context before never says anything again
  [queue.lost, queue.done] = [false, false];
  expect(gate.open).toBe(false);
  gate.reset();
  expect(gate.open).toBe(true);
});
