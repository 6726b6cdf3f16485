import { afterEach, describe, expect, test, vi } from "vitest";
import * as api from "../../src/client/api";
import { FakeRequest } from "./fake-request";

afterEach(() => {
  vi.unstubAllGlobals();
  vi.useRealTimers();
});

/** Answer every request with `status` and `body`; return the list of requests. */
function stubResponse(status: number, body: string): [string, RequestInit][] {
  const requests: [string, RequestInit][] = [];
  vi.stubGlobal("fetch", (path: string, options: RequestInit) => {
    requests.push([path, options]);
    return Promise.resolve(new Response(status === 204 ? null : body, { status }));
  });
  return requests;
}

test("lists are requested page by page", async () => {
  const requests = stubResponse(200, '{"items": [{"id": "a"}], "next": "b/c"}');
  const { items, next } = await api.listMotions();
  expect(items[0].id).toBe("a");
  await api.listMotions(next!);
  await api.listSessions();
  expect(requests.map(([path]) => path)).toEqual(["/v1/motions", "/v1/motions?cursor=b%2Fc", "/v1/sessions"]);
});

test("list is limited to words of the name and a tag", async () => {
  const requests = stubResponse(200, '{"items": [], "next": null}');
  await api.listMotions(undefined, { search: "鷺 & fan", tag: "" });
  await api.listMotions("c", { search: "", tag: "slow" });
  expect(requests.map(([path]) => path)).toEqual([
    "/v1/motions?search=%E9%B7%BA%20%26%20fan",
    "/v1/motions?cursor=c&tag=slow",
  ]);
});

/** Answer requests, given as "METHOD path", with these JSON values; return the list of requests. */
function stubResponses(responses: Record<string, unknown>): string[] {
  const requests: string[] = [];
  vi.stubGlobal("fetch", async (path: string, { method }: RequestInit) => {
    requests.push(`${method} ${path}`);
    return new Response(JSON.stringify(responses[`${method} ${path}`]), { status: 200 });
  });
  return requests;
}

test("running session is found without waiting for the library", async () => {
  stubResponses({ "GET /v1/sessions": { items: [{ id: "on" }, { id: "later" }], next: null } });
  expect(await api.findOrCreateSession(new Promise(() => undefined))).toEqual({ id: "on" });
});

test("session of the newest motion is created if none is running", async () => {
  const requests = stubResponses({ "GET /v1/sessions": { items: [], next: null }, "POST /v1/sessions": { id: "new" } });
  expect(await api.findOrCreateSession(Promise.resolve("dance"))).toEqual({ id: "new" });
  expect(requests).toEqual(["GET /v1/sessions", "POST /v1/sessions"]);
});

test("no session is created without a motion", async () => {
  const requests = stubResponses({ "GET /v1/sessions": { items: [], next: null } });
  expect(await api.findOrCreateSession(Promise.resolve(null))).toBeNull();
  expect(requests).toEqual(["GET /v1/sessions"]);
});

test("sessions are created and edited with JSON", async () => {
  const requests = stubResponse(200, '{"id": "s"}');
  await api.createSession("m");
  await api.editSession("s/..", { position: 5, playing: false });
  await api.getSession("s");
  expect(requests.map(([path, { method, body }]) => [method, path, body])).toEqual([
    ["POST", "/v1/sessions", '{"motion":"m"}'],
    ["PATCH", "/v1/sessions/s%2F..", '{"position":5,"playing":false}'],
    ["GET", "/v1/sessions/s", undefined],
  ]);
  expect(requests[0][1].headers).toEqual({ "Content-Type": "application/json" });
});

test("recording has name, length and camera if given", async () => {
  const requests = stubResponse(201, '{"id": "k"}');
  expect((await api.recordSession("s/1")).id).toBe("k");
  const key: api.CameraKeyframe = { time: 5, position: [0, 1, 4], gaze: [0, 1, 0], fov: 0.5 };
  await api.recordSession("s", { name: "Ours", seconds: 12.5, camera: [key] });
  expect(requests.map(([path, { method, body }]) => [method, path, JSON.parse(String(body))])).toEqual([
    ["POST", "/v1/sessions/s%2F1/recordings", {}],
    ["POST", "/v1/sessions/s/recordings", { name: "Ours", seconds: 12.5, camera: [key] }],
  ]);
});

test("performers of other motions are added", async () => {
  const requests = stubResponse(201, '{"id": "n", "performers": 3, "made_from": "m/1"}');
  expect((await api.addPerformers("m/1", ["a", "b"])).performers).toBe(3);
  expect(requests.map(([path, { method, body }]) => [method, path, body])).toEqual([
    ["POST", "/v1/motions/m%2F1/performers", '{"motions":["a","b"]}'],
  ]);
});

test("motion is deleted", async () => {
  const requests = stubResponse(204, "");
  await api.deleteMotion("m");
  expect(requests.map(([path, { method }]) => [method, path])).toEqual([["DELETE", "/v1/motions/m"]]);
});

describe("problems", () => {
  test("have hint, line and field", async () => {
    stubResponse(
      422,
      '{"title": "Not a motion", "detail": "two roots", "hint": "keep one", "line": 12, "field": "body"}',
    );
    await expect(api.createSession("m")).rejects.toMatchObject({
      name: "ProblemError",
      status: 422,
      title: "Not a motion",
      detail: "two roots",
      hint: "keep one",
      line: 12,
      field: "body",
    });
  });

  test("have status 0 if the server is unreachable", async () => {
    vi.stubGlobal("fetch", () => Promise.reject(new TypeError("fetch failed")));
    await expect(api.listMotions()).rejects.toMatchObject({ name: "ProblemError", status: 0, title: "No answer" });
  });
});

describe("uploads", () => {
  const file = new File(["HIERARCHY"], "my dance.bvh");

  test("send the file, report progress, and return the motion", async () => {
    vi.stubGlobal("XMLHttpRequest", FakeRequest);
    const reported: api.UploadProgress[] = [];
    const motion = api.uploadTakes(file, (progress) => reported.push(progress));
    expect(FakeRequest.last.arguments).toEqual([
      "POST",
      expect.stringMatching(/^\/v1\/motions\?filename=my%20dance.bvh&upload=[0-9a-f]{32}&takes=all$/),
      file,
    ]);
    expect(FakeRequest.last.headers).toEqual({ "Content-Type": "application/octet-stream" });
    FakeRequest.last.upload.dispatchEvent(Object.assign(new Event("progress"), { loaded: 3, total: 9 }));
    const reason = { take: "T-pose", title: "Nothing moves", detail: "it is a single pose", line: null, hint: null };
    const stored = { items: [{ id: "abc" }], skipped: [reason], pending: ["run"] };
    FakeRequest.last.respond(201, JSON.stringify(stored));
    expect(await motion).toEqual(stored);
    expect(reported).toEqual([{ stage: "sending", share: 1 / 3 }]);
  });

  test("poll the progress on the server after sending", async () => {
    vi.useFakeTimers();
    vi.stubGlobal("XMLHttpRequest", FakeRequest);
    const responses = [
      { stage: "receiving", share: 1 },
      { stage: "waiting", share: 0 },
      null,
      { stage: "encoding", share: 0.25 },
      { stage: "encoding", share: 0.5 },
    ];
    const paths: string[] = [];
    vi.stubGlobal("fetch", (path: string) => {
      paths.push(path);
      const response = responses[paths.length - 1];
      return Promise.resolve(new Response(JSON.stringify(response), { status: response ? 200 : 404 }));
    });
    const reported: api.UploadProgress[] = [];
    const motion = api.uploadTakes(file, (progress) => reported.push(progress));
    await vi.advanceTimersByTimeAsync(5 * api.PROGRESS_INTERVAL_MS);
    expect(paths).toEqual([]);
    FakeRequest.last.upload.dispatchEvent(new Event("load"));
    await vi.advanceTimersByTimeAsync(4.5 * api.PROGRESS_INTERVAL_MS);
    FakeRequest.last.respond(201, '{"items": [], "skipped": [], "pending": []}');
    await motion;
    await vi.advanceTimersByTimeAsync(5 * api.PROGRESS_INTERVAL_MS);
    expect(reported).toEqual([
      { stage: "waiting", share: 0 },
      { stage: "encoding", share: 0.25 },
      { stage: "encoding", share: 0.5 },
    ]);
    const uploadId = new URLSearchParams(String(FakeRequest.last.arguments[1]).split("?")[1]).get("upload");
    expect(paths).toEqual(new Array(5).fill(`/v1/uploads/${uploadId}`));
  });

  test("fail with the server's problem", async () => {
    vi.stubGlobal("XMLHttpRequest", FakeRequest);
    const motion = api.uploadTakes(file);
    FakeRequest.last.respond(422, '{"title": "Not a motion", "detail": "NaN", "line": 7}');
    await expect(motion).rejects.toMatchObject({ title: "Not a motion", line: 7 });
  });

  test("reject when aborted", async () => {
    vi.stubGlobal("XMLHttpRequest", FakeRequest);
    const cancel = new AbortController();
    const motion = api.uploadTakes(file, undefined, cancel.signal);
    cancel.abort();
    await expect(motion).rejects.toMatchObject({ name: "AbortError" });
    await expect(api.uploadTakes(file, undefined, cancel.signal)).rejects.toMatchObject({ name: "AbortError" });
  });
});
