import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { EngineConnection, EngineError } from "../../src/app/engine-connection";
import { startEngineWorker } from "../../src/app/engine-worker";
import type { EngineCommand, EngineEvent } from "../../src/engine/message";

const OPTIONS = { server: "", token: null, language: "en", timeOrigin: 0, bestQuality: false, view: null } as const;

/** Worker that answers as the test says. */
class FakeWorker {
  static first: unknown = { type: "hello", isSupported: true };
  static started: FakeWorker[] = [];
  onmessage: ((event: { data: unknown }) => void) | null = null;
  onerror: ((event: Event) => void) | null = null;
  readonly received: { type: string }[] = [];
  isTerminated = false;

  constructor() {
    FakeWorker.started.push(this);
    setTimeout(() => {
      if (FakeWorker.first === null) this.onerror?.(new Event("error"));
      else this.send(FakeWorker.first);
    });
  }

  postMessage(message: { type: string }): void {
    this.received.push(message);
  }

  send(data: unknown): void {
    this.onmessage?.({ data });
  }

  terminate(): void {
    this.isTerminated = true;
  }
}

let events: EngineEvent[];
let transferred: number;
let connection: EngineConnection;

beforeEach(() => {
  [events, transferred] = [[], 0];
  [FakeWorker.first, FakeWorker.started] = [{ type: "hello", isSupported: true }, []];
  vi.stubGlobal("Worker", FakeWorker);
  class FakeCanvas {
    getContext(): null {
      return null;
    }
    transferControlToOffscreen(): string {
      transferred++;
      return "offscreen";
    }
  }
  vi.stubGlobal("HTMLCanvasElement", FakeCanvas);
  const canvas = new FakeCanvas() as unknown as HTMLCanvasElement;
  connection = new EngineConnection(canvas, OPTIONS, (event) => events.push(event));
});
afterEach(() => void vi.unstubAllGlobals());

const toggleCamera: EngineCommand = { type: "toggle camera" };

test("a worker gets the canvas, then what was sent before it had started, in order", async () => {
  connection.post({ type: "performer", performer: 1 });
  connection.post(toggleCamera);
  await connection.start(await startEngineWorker("main.js", null));
  connection.post({ type: "performer", performer: 2 });
  const [worker] = FakeWorker.started;
  expect(worker.received.map(({ type }) => type)).toEqual(["start", "performer", "toggle camera", "performer"]);
  expect(worker.received[0]).toMatchObject({ canvas: "offscreen", options: OPTIONS });
  worker.send({ type: "ready" });
  expect(events).toEqual([{ type: "ready" }]);
});

test("errors of a running worker are errors of the page", async () => {
  const reported: unknown[] = [];
  vi.stubGlobal("reportError", (error: unknown) => reported.push(error));
  await connection.start(await startEngineWorker("main.js", null));
  const error = Object.assign(new Event("error"), { message: "no limb 9", filename: "engine.js", lineno: 3 });
  FakeWorker.started[0].onerror?.(error);
  expect(String(reported[0])).toContain("no limb 9 (engine.js:3)");
});

test("responses reach their requests", async () => {
  await connection.start(await startEngineWorker("main.js", null));
  const [worker] = FakeWorker.started;
  const [picture, keyframes] = [
    connection.request({ kind: "picture" }),
    connection.request({ kind: "camera keyframes" }),
  ];
  const failure = { known: null, message: "no stage" };
  worker.send({ type: "response", id: 2, result: [] });
  worker.send({ type: "response", id: 1, failure });
  expect(await keyframes).toEqual([]);
  await expect(picture).rejects.toEqual(new EngineError(failure));
  expect(events).toEqual([]);
});

test.for([
  ["cannot draw, and closes itself", { type: "hello", isSupported: false }, false],
  ["does not load", null, true],
] as const)("the engine runs in the page if the worker %s", async ([, first, isTerminated]) => {
  FakeWorker.first = first;
  connection.post(toggleCamera);
  await connection.start(await startEngineWorker("main.js", null));
  expect([FakeWorker.started[0].isTerminated, transferred]).toEqual([isTerminated, 0]);
  // This page has no graphics either: its engine says so.
  await expect.poll(() => events.map(({ type }) => type)).toContain("unavailable");
});

test("the engine runs in the page if a worker is not wanted or not possible", async () => {
  await connection.start(await startEngineWorker("main.js", "page"));
  expect(FakeWorker.started).toEqual([]);
  await expect.poll(() => events.map(({ type }) => type)).toContain("unavailable");
});

test("requests fail, and later messages are dropped, if no engine can be loaded", async () => {
  FakeWorker.first = null;
  vi.doMock("../../src/engine/engine", () => {
    throw new Error("not loaded");
  });
  const before = connection.request({ kind: "picture" });
  const rejected = expect(before).rejects.toBeInstanceOf(EngineError);
  await connection.start(await startEngineWorker("main.js", null));
  await rejected;
  expect(events).toEqual([{ type: "unavailable", reason: "not loaded" }]);
  connection.post(toggleCamera);
  await expect(connection.request({ kind: "camera keyframes" })).rejects.toBeInstanceOf(EngineError);
  vi.doUnmock("../../src/engine/engine");
});
