import { afterEach, expect, test, vi } from "vitest";
import { findSession } from "../src/room";

const asked: string[] = [];

function server(answers: Record<string, unknown>): void {
  vi.stubGlobal("fetch", async (path: string, { method }: RequestInit) => {
    asked.push(`${method} ${path}`);
    return new Response(JSON.stringify(answers[`${method} ${path}`]), { status: 200 });
  });
}

afterEach(() => {
  asked.length = 0;
  vi.unstubAllGlobals();
});

test("the session that is on is entered without waiting for the library", async () => {
  server({ "GET /v1/sessions": { items: [{ id: "on" }, { id: "later" }], next: null } });
  expect(await findSession(new Promise(() => undefined))).toEqual({ id: "on" });
});

test("where none is on, one is opened over the newest motion", async () => {
  server({ "GET /v1/sessions": { items: [], next: null }, "POST /v1/sessions": { id: "new" } });
  expect(await findSession(Promise.resolve("dance"))).toEqual({ id: "new" });
  expect(asked).toEqual(["GET /v1/sessions", "POST /v1/sessions"]);
});

test("with nothing to dance there is no session", async () => {
  server({ "GET /v1/sessions": { items: [], next: null } });
  expect(await findSession(Promise.resolve(null))).toBeNull();
  expect(asked).toEqual(["GET /v1/sessions"]);
});
