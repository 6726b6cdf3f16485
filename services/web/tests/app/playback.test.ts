import { afterEach, expect, test, vi } from "vitest";
import { findOrCreateSession, Playback } from "../../src/app/playback";
import { Access } from "../../src/client/access";
import { FakeWebSocket } from "../client/fake-websocket";

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
  expect(await findOrCreateSession(new Promise(() => undefined))).toEqual({ id: "on" });
});

test("where none is on, one is opened over the newest motion", async () => {
  server({ "GET /v1/sessions": { items: [], next: null }, "POST /v1/sessions": { id: "new" } });
  expect(await findOrCreateSession(Promise.resolve("dance"))).toEqual({ id: "new" });
  expect(asked).toEqual(["GET /v1/sessions", "POST /v1/sessions"]);
});

test("with nothing to dance there is no session", async () => {
  server({ "GET /v1/sessions": { items: [], next: null } });
  expect(await findOrCreateSession(Promise.resolve(null))).toBeNull();
  expect(asked).toEqual(["GET /v1/sessions"]);
});

test("a room of another server is asked for, entered and edited there", async () => {
  FakeWebSocket.install();
  const access = new Access("https://stage.example");
  server({
    "GET https://stage.example/v1/sessions": { items: [{ id: "on" }], next: null },
    "PATCH https://stage.example/v1/sessions/on": {},
  });
  expect(await findOrCreateSession(Promise.resolve(null), access)).toEqual({ id: "on" });
  const lines = () => FakeWebSocket.opened.map(({ url }) => url);
  const room = new Playback("on", "Aiko", () => undefined, { access });
  expect(lines()).toEqual([
    "wss://stage.example/v1/sessions/on/stream",
    "wss://stage.example/v1/sessions/on/control?name=Aiko",
  ]);
  room.edit({ playing: false });
  expect(asked.at(-1)).toBe("PATCH https://stage.example/v1/sessions/on");
  room.close();
  FakeWebSocket.opened.length = 0;
  const watched = new Playback("on", "Aiko", () => undefined, { access, viewOnly: true });
  expect(lines()).toEqual(["wss://stage.example/v1/sessions/on/stream"]);
  watched.close();
  FakeWebSocket.remove();
});

test("steps are blocks of the dance, and end where it does", async () => {
  FakeWebSocket.install();
  server({ "PATCH https://stage.example/v1/sessions/on": {} });
  const room = new Playback("on", "Aiko", () => undefined, { access: new Access("https://stage.example") });
  const sought = vi.spyOn(room, "seek");
  room.seekByBlocks(1, 0);
  expect(sought).not.toHaveBeenCalled();
  vi.spyOn(room.viewer, "blocks", "get").mockReturnValue(new Int8Array(20));
  vi.spyOn(room.viewer, "duration", "get").mockReturnValue(30);
  const at = vi.spyOn(room.viewer, "positionAt").mockReturnValue(12);
  room.seekByBlocks(1, 7);
  expect(sought).toHaveBeenLastCalledWith(13.5, 7);
  room.seekByBlocks(-2, 8);
  // from where the step before leads
  expect(sought).toHaveBeenLastCalledWith(10.5, 8);
  room.seekByBlocks(100, 9);
  expect(sought).toHaveBeenLastCalledWith(30, 9);
  room.seekByBlocks(-100, 10);
  expect(sought).toHaveBeenLastCalledWith(0, 10);
  at.mockRestore();
  room.close();
  FakeWebSocket.remove();
});
