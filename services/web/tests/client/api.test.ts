import { afterEach, describe, expect, test, vi } from "vitest";
import * as library from "../../src/client/api";

afterEach(() => {
  vi.unstubAllGlobals();
  vi.useRealTimers();
});

/** Answers every request with `status` and `body`; the requests made. */
function stubResponse(status: number, body: string): [string, RequestInit][] {
  const made: [string, RequestInit][] = [];
  vi.stubGlobal("fetch", (path: string, options: RequestInit) => {
    made.push([path, options]);
    return Promise.resolve(new Response(status === 204 ? null : body, { status }));
  });
  return made;
}

test("lists are asked for page by page", async () => {
  const made = stubResponse(200, '{"items": [{"id": "a"}], "next": "b/c"}');
  const { items, next } = await library.listMotions();
  expect(items[0].id).toBe("a");
  await library.listMotions(next!);
  await library.listSessions();
  expect(made.map(([path]) => path)).toEqual(["/v1/motions", "/v1/motions?cursor=b%2Fc", "/v1/sessions"]);
});

test("sessions are made and edited with JSON", async () => {
  const made = stubResponse(200, '{"id": "s"}');
  await library.createSession("m");
  await library.editSession("s/..", { position: 5, playing: false });
  await library.getSession("s");
  expect(made.map(([path, { method, body }]) => [method, path, body])).toEqual([
    ["POST", "/v1/sessions", '{"motion":"m"}'],
    ["PATCH", "/v1/sessions/s%2F..", '{"position":5,"playing":false}'],
    ["GET", "/v1/sessions/s", undefined],
  ]);
  expect(made[0][1].headers).toEqual({ "Content-Type": "application/json" });
});

test("a session is kept with what was given of name, length and camera", async () => {
  const made = stubResponse(201, '{"id": "k"}');
  expect((await library.recordSession("s/1")).id).toBe("k");
  const key: library.CameraKeyframe = { time: 5, position: [0, 1, 4], gaze: [0, 1, 0], fov: 0.5 };
  await library.recordSession("s", { name: "Ours", seconds: 12.5, camera: [key] });
  expect(made.map(([path, { method, body }]) => [method, path, JSON.parse(String(body))])).toEqual([
    ["POST", "/v1/sessions/s%2F1/recordings", {}],
    ["POST", "/v1/sessions/s/recordings", { name: "Ours", seconds: 12.5, camera: [key] }],
  ]);
});

test("others come to dance beside those of a motion", async () => {
  const made = stubResponse(201, '{"id": "n", "performers": 3, "made_from": "m/1"}');
  expect((await library.addPerformers("m/1", ["a", "b"])).performers).toBe(3);
  expect(made.map(([path, { method, body }]) => [method, path, body])).toEqual([
    ["POST", "/v1/motions/m%2F1/performers", '{"motions":["a","b"]}'],
  ]);
});

test("a motion is removed", async () => {
  const made = stubResponse(204, "");
  await library.deleteMotion("m");
  expect(made.map(([path, { method }]) => [method, path])).toEqual([["DELETE", "/v1/motions/m"]]);
});

describe("problems", () => {
  test("are told with their hint, line and field", async () => {
    stubResponse(
      422,
      '{"title": "Not a motion", "detail": "two roots", "hint": "keep one", "line": 12, "field": "body"}',
    );
    await expect(library.createSession("m")).rejects.toMatchObject({
      name: "ProblemError",
      status: 422,
      title: "Not a motion",
      detail: "two roots",
      hint: "keep one",
      line: 12,
      field: "body",
    });
  });

  test("where nobody answers", async () => {
    vi.stubGlobal("fetch", () => Promise.reject(new TypeError("fetch failed")));
    await expect(library.listMotions()).rejects.toMatchObject({ name: "ProblemError", status: 0, title: "No answer" });
  });
});

describe("uploads", () => {
  /** The browser's request as the test plays it. */
  class Request extends EventTarget {
    static last: Request;
    readonly upload = new EventTarget();
    readonly headers: Record<string, string> = {};
    status = 0;
    responseText = "";
    asked: unknown[] = [];
    constructor() {
      super();
      Request.last = this;
    }
    open(...asked: unknown[]): void {
      this.asked = asked;
    }
    setRequestHeader(name: string, value: string): void {
      this.headers[name] = value;
    }
    send(body: unknown): void {
      this.asked.push(body);
    }
    abort(): void {
      this.dispatchEvent(new Event("abort"));
      this.dispatchEvent(new Event("loadend"));
    }
    answer(status: number, text: string): void {
      this.status = status;
      this.responseText = text;
      this.dispatchEvent(new Event("load"));
      this.dispatchEvent(new Event("loadend"));
    }
  }

  const file = new File(["HIERARCHY"], "my dance.bvh");

  test("send the file as it is, tell their progress, and give the motion", async () => {
    vi.stubGlobal("XMLHttpRequest", Request);
    const told: library.UploadProgress[] = [];
    const motion = library.uploadMotion(file, (progress) => told.push(progress));
    expect(Request.last.asked).toEqual([
      "POST",
      expect.stringMatching(/^\/v1\/motions\?filename=my%20dance.bvh&upload=[0-9a-f]{32}$/),
      file,
    ]);
    expect(Request.last.headers).toEqual({ "Content-Type": "application/octet-stream" });
    Request.last.upload.dispatchEvent(Object.assign(new Event("progress"), { loaded: 3, total: 9 }));
    Request.last.answer(201, '{"id": "abc"}');
    expect((await motion).id).toBe("abc");
    expect(told).toEqual([{ stage: "sending", share: 1 / 3 }]);
  });

  test("ask what the server does with them once they are sent, until it answers", async () => {
    vi.useFakeTimers();
    vi.stubGlobal("XMLHttpRequest", Request);
    const answers = [
      { stage: "receiving", share: 1 },
      { stage: "waiting", share: 0 },
      null,
      { stage: "encoding", share: 0.25 },
      { stage: "encoding", share: 0.5 },
    ];
    const asked: string[] = [];
    vi.stubGlobal("fetch", (path: string) => {
      asked.push(path);
      const answer = answers[asked.length - 1];
      return Promise.resolve(new Response(JSON.stringify(answer), { status: answer ? 200 : 404 }));
    });
    const told: library.UploadProgress[] = [];
    const motion = library.uploadMotion(file, (progress) => told.push(progress));
    await vi.advanceTimersByTimeAsync(5 * library.PROGRESS_INTERVAL_MS);
    expect(asked).toEqual([]);
    Request.last.upload.dispatchEvent(new Event("load"));
    await vi.advanceTimersByTimeAsync(4.5 * library.PROGRESS_INTERVAL_MS);
    Request.last.answer(201, '{"id": "abc"}');
    await motion;
    await vi.advanceTimersByTimeAsync(5 * library.PROGRESS_INTERVAL_MS);
    expect(told).toEqual([
      { stage: "waiting", share: 0 },
      { stage: "encoding", share: 0.25 },
      { stage: "encoding", share: 0.5 },
    ]);
    const name = new URLSearchParams(String(Request.last.asked[1]).split("?")[1]).get("upload");
    expect(asked).toEqual(new Array(5).fill(`/v1/uploads/${name}`));
  });

  test("are refused with the server's words", async () => {
    vi.stubGlobal("XMLHttpRequest", Request);
    const motion = library.uploadMotion(file);
    Request.last.answer(422, '{"title": "Not a motion", "detail": "NaN", "line": 7}');
    await expect(motion).rejects.toMatchObject({ title: "Not a motion", line: 7 });
  });

  test("are cancelled", async () => {
    vi.stubGlobal("XMLHttpRequest", Request);
    const cancel = new AbortController();
    const motion = library.uploadMotion(file, undefined, cancel.signal);
    cancel.abort();
    await expect(motion).rejects.toMatchObject({ name: "AbortError" });
    await expect(library.uploadMotion(file, undefined, cancel.signal)).rejects.toMatchObject({ name: "AbortError" });
  });
});
