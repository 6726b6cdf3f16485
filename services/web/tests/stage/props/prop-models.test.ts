import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { Access } from "../../../src/client/access";
import { PROP_FORMS } from "../../../src/motion/props";
import { PropModels } from "../../../src/stage/props/prop-models";
import { EXTRAS, STORED_ID, writePropModel } from "../../prop-model-file";

let models: PropModels;
let requests: [url: string, headers: unknown, signal: AbortSignal][];
let respond: () => Promise<Response> | Response;

beforeEach(() => {
  vi.useFakeTimers();
  models = new PropModels(new Access("https://stage.example", "a.token"));
  requests = [];
  respond = () => new Response(writePropModel());
  vi.stubGlobal("fetch", async (url: string, { headers, signal }: RequestInit) => {
    requests.push([url, headers, signal as AbortSignal]);
    return respond();
  });
});
afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
  vi.restoreAllMocks();
});

/** Let requests and their retries end. */
const settle = () => vi.advanceTimersByTimeAsync(60_000);
const problem = (status: number) => () => Response.json({ title: "No", detail: "not now" }, { status });

test("built-in models are there at once, and stay the same", () => {
  const fan = models.get("fan");
  expect(fan?.form).toBe(PROP_FORMS.fan);
  expect(models.get("fan")).toBe(fan);
  expect(requests).toEqual([]);
});

test("kinds that cannot be drawn have no model, and are not requested", async () => {
  for (const kind of ["sword", "", "../../sessions", "toString"]) {
    expect(models.get(kind)).toBeNull();
    expect(await models.load(kind)).toBeNull();
  }
  expect(requests).toEqual([]);
});

test("a stored model is requested once, with the access of its server, and is there afterwards", async () => {
  expect(models.get(STORED_ID)).toBeNull();
  expect(models.get(STORED_ID)).toBeNull();
  await settle();
  const url = `https://stage.example/v1/props/${STORED_ID}/model`;
  expect(requests).toEqual([[url, { Authorization: "Bearer a.token" }, expect.any(AbortSignal)]]);
  const model = models.get(STORED_ID);
  expect(model?.form).toEqual({ rest: { pitch: EXTRAS.pitch, height: EXTRAS.height }, palmOffset: 0 });
  expect(await models.load(STORED_ID)).toBe(model);
  expect(requests).toHaveLength(1);
});

test.each([0, 429, 503])("after an answer %i the request is sent again, later each time", async (status) => {
  respond = status === 0 ? () => Promise.reject(new TypeError("no network")) : problem(status);
  models.get(STORED_ID);
  await vi.advanceTimersByTimeAsync(500);
  expect(requests).toHaveLength(1);
  await vi.advanceTimersByTimeAsync(1_000);
  expect(requests).toHaveLength(2);
  respond = () => new Response(writePropModel());
  await vi.advanceTimersByTimeAsync(2_000);
  expect(requests).toHaveLength(3);
  expect(models.get(STORED_ID)).not.toBeNull();
});

test.each([
  ["removed", problem(404), 1],
  ["refused", problem(403), 1],
  ["not sent", problem(503), 4],
  ["damaged", () => new Response("sword"), 1],
])(
  "a model that is %s is requested a few times, and again when the prop is brought again",
  async (_, answer, count) => {
    vi.spyOn(console, "warn").mockReturnValue();
    respond = answer;
    for (let frame = 0; frame < 3; frame++) {
      expect(models.get(STORED_ID)).toBeNull();
      models.retain(new Set([STORED_ID, "fan"]));
      await settle();
    }
    expect(requests).toHaveLength(count);
    expect(models.get("fan")).not.toBeNull();
    // It was removed from the stage, and is brought again.
    models.retain(new Set());
    respond = () => new Response(writePropModel());
    models.get(STORED_ID);
    await settle();
    expect(models.get(STORED_ID)).not.toBeNull();
  },
);

test("loading rejects if the server does not send the model, and has none that is removed", async () => {
  respond = problem(403);
  await expect(models.load(STORED_ID)).rejects.toMatchObject({ status: 403 });
  models = new PropModels();
  respond = problem(404);
  expect(await models.load(STORED_ID)).toBeNull();
});

test("a request that is not answered ends, and is sent again", async () => {
  respond = () =>
    new Promise((_, reject) => requests[0][2].addEventListener("abort", () => reject(new Error("aborted"))));
  const loading = models.load(STORED_ID);
  await vi.advanceTimersByTimeAsync(29_000);
  expect(requests).toHaveLength(1);
  respond = problem(404);
  await vi.advanceTimersByTimeAsync(3_000);
  expect(await loading).toBeNull();
  expect(requests).toHaveLength(2);
});

test("few models are kept, and all that are used", async () => {
  const ids = Array.from({ length: 20 }, (_, at) => `${"abcdefghijklmnopqrst"[at]}${STORED_ID.slice(1)}`);
  for (const id of ids) models.get(id);
  await settle();
  models.retain(new Set([ids[0]]));
  requests = [];
  for (const id of ids) models.get(id);
  expect(requests.map(([url]) => url)).toEqual(
    ids.slice(1, 5).map((id) => `https://stage.example/v1/props/${id}/model`),
  );
});
