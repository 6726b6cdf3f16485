import { afterEach, expect, test, vi } from "vitest";
import { Access } from "../../src/client/access";
import { findOrCreateSession } from "../../src/client/api";
import { Playback } from "../../src/engine/playback";
import { FakeWebSocket } from "../client/fake-websocket";

const requests: string[] = [];

/** Answer requests, given as "METHOD path", with these JSON values. */
function stubServer(responses: Record<string, unknown>): void {
  vi.stubGlobal("fetch", async (path: string, { method }: RequestInit) => {
    requests.push(`${method} ${path}`);
    return new Response(JSON.stringify(responses[`${method} ${path}`]), { status: 200 });
  });
}

afterEach(() => {
  requests.length = 0;
  vi.unstubAllGlobals();
});

test("session of another server is found, opened and edited there", async () => {
  FakeWebSocket.install();
  const access = new Access("https://stage.example");
  stubServer({
    "GET https://stage.example/v1/sessions": { items: [{ id: "on" }], next: null },
    "PATCH https://stage.example/v1/sessions/on": {},
  });
  expect(await findOrCreateSession(Promise.resolve(null), access)).toEqual({ id: "on" });
  const urls = () => FakeWebSocket.opened.map(({ url }) => url);
  const playback = new Playback("on", "Aiko", () => undefined, { access });
  expect(urls()).toEqual([
    "wss://stage.example/v1/sessions/on/stream?extensions=true&parts=body%2Cfingers%2Cface%2Ccontacts%2Cprops",
    "wss://stage.example/v1/sessions/on/control?name=Aiko",
  ]);
  playback.edit({ playing: false });
  expect(requests.at(-1)).toBe("PATCH https://stage.example/v1/sessions/on");
  playback.close();
  FakeWebSocket.opened.length = 0;
  const viewOnly = new Playback("on", "Aiko", () => undefined, { access, viewOnly: true });
  expect(urls()).toEqual([
    "wss://stage.example/v1/sessions/on/stream?extensions=true&parts=body%2Cfingers%2Cface%2Ccontacts%2Cprops",
  ]);
  viewOnly.close();
  FakeWebSocket.remove();
});

test("seek by blocks moves by whole blocks within the motion", async () => {
  FakeWebSocket.install();
  stubServer({ "PATCH https://stage.example/v1/sessions/on": {} });
  const playback = new Playback("on", "Aiko", () => undefined, { access: new Access("https://stage.example") });
  const seek = vi.spyOn(playback, "seek");
  playback.seekByBlocks(1, 0);
  expect(seek).not.toHaveBeenCalled();
  vi.spyOn(playback.viewer, "blocks", "get").mockReturnValue(new Int8Array(20));
  vi.spyOn(playback.viewer, "duration", "get").mockReturnValue(30);
  const positionAt = vi.spyOn(playback.viewer, "positionAt").mockReturnValue(12);
  playback.seekByBlocks(1, 7);
  expect(seek).toHaveBeenLastCalledWith(13.5, 7);
  playback.seekByBlocks(-2, 8);
  // relative to the target of the pending seek
  expect(seek).toHaveBeenLastCalledWith(10.5, 8);
  playback.seekByBlocks(100, 9);
  expect(seek).toHaveBeenLastCalledWith(30, 9);
  playback.seekByBlocks(-100, 10);
  expect(seek).toHaveBeenLastCalledWith(0, 10);
  positionAt.mockRestore();
  // The later seeks are one request, which is not to reach the server of another test.
  await expect.poll(() => requests.length).toBe(2);
  playback.close();
  FakeWebSocket.remove();
});

test("edits in quick succession are merged", async () => {
  vi.useFakeTimers();
  FakeWebSocket.install();
  const bodies: unknown[] = [];
  vi.stubGlobal("fetch", async (_: string, { body }: RequestInit) => {
    bodies.push(JSON.parse(body as string));
    return new Response("{}", { status: 200 });
  });
  const playback = new Playback("on", "Aiko", () => undefined, { access: new Access("https://stage.example") });
  for (let position = 0; position < 100; position++) {
    playback.edit({ position });
    // a pointer that is dragged, on a server that answers at once
    await vi.advanceTimersByTimeAsync(10);
  }
  await vi.advanceTimersByTimeAsync(200);
  expect(bodies.length).toBeGreaterThan(2);
  expect(bodies.length).toBeLessThanOrEqual(20);
  expect(bodies.at(-1)).toEqual({ position: 99 });
  playback.close();
  FakeWebSocket.remove();
  vi.useRealTimers();
});
