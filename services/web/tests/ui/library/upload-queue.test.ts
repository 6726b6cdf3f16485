/** Queue of uploads. */
import { expect, test, vi } from "vitest";
import type { Motion, StoredTakes, UploadProgress } from "../../../src/client/api";
import { ProblemError } from "../../../src/client/problem";
import type { UploadList, UploadSummary } from "../../../src/ui/library/upload-list";
import { UploadQueue, type UploadQueueOptions } from "../../../src/ui/library/upload-queue";

/** Upload under control of a test. */
interface Upload {
  resolve(stored: Partial<StoredTakes>): void;
  reject(error: unknown): void;
  progress(progress: UploadProgress): void;
}

/** Queue whose uploads and list are fakes; `log` has what the user is told, in order. */
function createQueue() {
  const uploads = new Map<string, Upload>();
  const rows = new Map<string, () => void>();
  const log: string[] = [];
  let summary: UploadSummary | null = null;
  let cancelAll = () => {};
  const list: UploadList = {
    addFile(name, cancel) {
      rows.set(name, cancel);
      return { show: () => {}, remove: () => rows.delete(name) };
    },
    showSummary(shown) {
      summary = shown;
    },
  };
  const options: UploadQueueOptions = {
    upload: (file, progress, signal) =>
      new Promise((resolve, reject) => {
        signal.addEventListener("abort", () => reject(signal.reason as Error));
        uploads.set(file.name, {
          resolve: (stored) => resolve({ items: [], skipped: [], pending: [], ...stored }),
          reject,
          progress,
        });
      }),
    library: {
      problem: (name, title, detail, hint) => log.push(`${name}: ${title}: ${detail} (${hint})`),
      clearProblems: () => log.push("clear"),
    },
    createList(onCancelAll) {
      cancelAll = onCancelAll;
      return list;
    },
    onStored: (motions, isFirst, hasMore) => {
      const ids = motions.map(({ id }) => id).join(" ");
      log.push(`stored ${ids}${isFirst ? ", first" : ""}${hasMore ? ", more" : ""}`);
      return Promise.resolve();
    },
    onPending: (count) => log.push(`pending ${count}`),
    onFinished: (count) => log.push(`finished ${count}`),
  };
  const queue = new UploadQueue(options);
  /** The upload of a file, once it has started. */
  const started = async (name: string): Promise<Upload> => {
    await vi.waitUntil(() => uploads.has(name));
    return uploads.get(name) as Upload;
  };
  return { queue, uploads, rows, log, started, getSummary: () => summary, cancelAll: () => cancelAll() };
}

function files(...names: string[]): File[] {
  return names.map((name) => new File(["x"], name));
}

function motion(id: string): Motion {
  return { id } as Motion;
}

test("files are uploaded one after another, and one that fails does not stop the others", async () => {
  const { queue, uploads, rows, log, started, getSummary } = createQueue();
  const finished = queue.add(files("a", "b", "c"));
  expect([...rows.keys()]).toEqual(["a", "b", "c"]);
  expect(getSummary()).toEqual({ number: 1, count: 3, fraction: 0 });
  (await started("a")).progress({ stage: "sending", share: 0.5 });
  expect(getSummary()?.fraction).toBeCloseTo(0.25 / 3);
  (await started("a")).progress({ stage: "encoding", share: 0.5, take: 2, takes: 2 });
  expect(getSummary()?.fraction).toBeCloseTo(0.875 / 3);
  expect([...uploads.keys()]).toEqual(["a"]);
  (await started("a")).resolve({ items: [motion("a1"), motion("a2")] });
  (await started("b")).reject(new ProblemError(422, "Not a BVH file", "it is empty", "export it", 3));
  (await started("c")).resolve({ items: [motion("c1")] });
  await finished;
  expect(log).toEqual([
    "clear",
    "stored a1 a2, first, more",
    "b: Not a BVH file: it is empty (line 3) (export it)",
    "stored c1",
    "finished 3",
  ]);
  expect(rows.size).toBe(0);
  expect(getSummary()).toBeNull();
});

test("one file has no summary, and files can be added meanwhile", async () => {
  const { queue, log, started, getSummary } = createQueue();
  const finished = queue.add(files("a"));
  expect(getSummary()).toBeNull();
  void queue.add(files("b", "c"));
  expect(getSummary()).toEqual({ number: 1, count: 3, fraction: 0 });
  (await started("a")).resolve({ items: [motion("a1")] });
  (await started("b")).resolve({});
  (await started("c")).resolve({ items: [motion("c1")] });
  await finished;
  expect(log).toEqual(["clear", "stored a1, first, more", "stored , more", "stored c1, first", "finished 2"]);
});

test("a waiting or running upload is cancelled without a message", async () => {
  const { queue, rows, uploads, log, started, getSummary } = createQueue();
  const finished = queue.add(files("a", "b", "c"));
  await started("a");
  rows.get("b")?.();
  expect([...rows.keys()]).toEqual(["a", "c"]);
  expect(getSummary()?.count).toBe(2);
  rows.get("a")?.();
  (await started("c")).resolve({ items: [motion("c1")] });
  await finished;
  expect(log).toEqual(["clear", "stored c1, first", "finished 1"]);
  expect([...uploads.keys()]).toEqual(["a", "c"]);
});

test("all uploads are cancelled together", async () => {
  const { queue, rows, uploads, log, started, getSummary, cancelAll } = createQueue();
  const finished = queue.add(files("a", "b", "c"));
  await started("a");
  cancelAll();
  await finished;
  expect([rows.size, [...uploads.keys()], getSummary(), log]).toEqual([0, ["a"], null, ["clear", "finished 0"]]);
});

test("takes that were left out are listed with their reasons", async () => {
  const { queue, log, started } = createQueue();
  const finished = queue.add(files("a"));
  const skipped = Array.from({ length: 12 }, (_, number) => ({
    take: number === 0 ? null : `take ${number}`,
    title: "Broken",
    detail: "no",
    line: number === 1 ? 7 : null,
    hint: "export it",
  }));
  (await started("a")).resolve({ items: [motion("a1")], skipped, pending: ["x", "y"] });
  await finished;
  const [, message, ...others] = log;
  const lines = message.split("\n");
  expect(lines.slice(0, 3)).toEqual([
    "a: Not all of its takes are in the library: no",
    "take 1: Broken, no (line 7)",
    "take 2: Broken, no",
  ]);
  expect(lines.at(-1)).toBe("and 2 more (null)");
  expect(others).toEqual(["pending 2", "stored a1, first, more", "finished 1"]);
});
