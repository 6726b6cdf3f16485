import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { Access } from "../../src/client/access";
import { deleteProp, fetchPropModel, getProp, listProps, uploadProp } from "../../src/client/stored-props";
import { STORED_ID } from "../prop-model-file";
import { FakeRequest } from "./fake-request";

const access = new Access("https://stage.example", "a.token");
let requests: string[];
let respond: () => Response;

beforeEach(() => {
  requests = [];
  respond = () => Response.json({ items: [{ id: STORED_ID }], next: null });
  vi.stubGlobal("fetch", (url: string, { method = "GET", headers }: RequestInit) => {
    expect(headers).toMatchObject(url.startsWith("/") ? {} : { Authorization: "Bearer a.token" });
    requests.push(`${method} ${url}`);
    return Promise.resolve(respond());
  });
});
afterEach(() => {
  vi.unstubAllGlobals();
  vi.useRealTimers();
});

test("props are listed page by page, described and deleted", async () => {
  expect(await listProps({ limit: 24 })).toEqual({ items: [{ id: STORED_ID }], next: null });
  await listProps({ cursor: "a/b" }, access);
  await listProps();
  await getProp(STORED_ID, access);
  respond = () => new Response(null, { status: 204 });
  await deleteProp(STORED_ID);
  expect(requests).toEqual([
    "GET /v1/props?limit=24",
    "GET https://stage.example/v1/props?cursor=a%2Fb",
    "GET /v1/props",
    `GET https://stage.example/v1/props/${STORED_ID}`,
    `DELETE /v1/props/${STORED_ID}`,
  ]);
});

test("a file is uploaded under its name", async () => {
  vi.stubGlobal("XMLHttpRequest", FakeRequest);
  const uploaded = uploadProp(new File(["glTF"], "my sword.glb"), { access });
  expect(FakeRequest.last.arguments.slice(0, 2)).toEqual([
    "POST",
    "https://stage.example/v1/props?filename=my%20sword.glb",
  ]);
  FakeRequest.last.respond(201, JSON.stringify({ id: STORED_ID, name: "my sword" }));
  expect(await uploaded).toMatchObject({ id: STORED_ID, name: "my sword" });
});

test("a model is fetched as bytes; an answer that breaks off is a problem", async () => {
  respond = () => new Response(Uint8Array.of(1, 2, 3));
  expect(new Uint8Array(await fetchPropModel(STORED_ID, access))).toEqual(Uint8Array.of(1, 2, 3));
  expect(requests).toEqual([`GET https://stage.example/v1/props/${STORED_ID}/model`]);
  respond = () => new Response(new ReadableStream({ pull: (stream) => stream.error(new Error("reset")) }));
  await expect(fetchPropModel(STORED_ID, access)).rejects.toMatchObject({ name: "ProblemError", status: 0 });
});

test("a model may take long, but not stall", async () => {
  vi.useFakeTimers();
  let stream: ReadableStreamDefaultController | null = null;
  vi.stubGlobal("fetch", (_: string, { signal }: RequestInit) => {
    const body = new ReadableStream({ start: (controller) => void (stream = controller) });
    signal?.addEventListener("abort", () => stream?.error(signal.reason));
    return Promise.resolve(new Response(body));
  });
  const send = async () => {
    await vi.advanceTimersByTimeAsync(29_000);
    stream?.enqueue(Uint8Array.of(7));
  };
  const whole = fetchPropModel(STORED_ID, access);
  for (let chunk = 0; chunk < 3; chunk++) await send();
  stream!.close();
  expect((await whole).byteLength).toBe(3);
  const stalled = fetchPropModel(STORED_ID, access).catch((error: unknown) => error);
  await send();
  await vi.advanceTimersByTimeAsync(31_000);
  expect(await stalled).toMatchObject({ name: "ProblemError", status: 0 });
  expect(vi.getTimerCount()).toBe(0);
});
