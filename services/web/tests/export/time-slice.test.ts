import { expect, test } from "vitest";
import type { IncrementalTask } from "../../src/export/sampled-motion";
import { runInSlices } from "../../src/export/time-slice";

/** Create a task of ten steps of 3 ms on a fake clock. */
function steps(): { work: IncrementalTask<string>; now: () => number; taken: () => number } {
  let time = 0;
  let taken = 0;
  function* work(): IncrementalTask<string> {
    for (; taken < 10; taken++) {
      time += 3;
      yield taken / 10;
    }
    return "done";
  }
  return { work: work(), now: () => time, taken: () => taken };
}

test("yields after every few milliseconds and reports progress", async () => {
  const { work, now } = steps();
  const shares: number[] = [];
  let pauses = 0;
  const result = await runInSlices(work, {
    now,
    onProgress: (share) => shares.push(share),
    yieldToEventLoop: async () => void pauses++,
  });
  expect(result).toBe("done");
  expect(shares).toEqual([0.2, 0.5, 0.8]);
  expect(pauses).toBe(3);
});

test("stops when aborted", async () => {
  const { work, now, taken } = steps();
  const abort = new AbortController();
  const reason = new Error("given up");
  await expect(
    runInSlices(work, { now, signal: abort.signal, yieldToEventLoop: async () => abort.abort(reason) }),
  ).rejects.toBe(reason);
  expect(taken()).toBe(2);
});

test("uses the browser's clock and event loop by default", async () => {
  expect(await runInSlices(steps().work)).toBe("done");
});
