import { createServer, type RequestListener, type Server } from "node:http";
import type { AddressInfo } from "node:net";
import { afterEach, expect, test, vi } from "vitest";
import { diagnoseUnreachable } from "../../src/client/server-diagnosis";
import { loadJapaneseTranslator } from "../../src/i18n/language";

const SITE = "https://dance.example";
let server: Server | null = null;

afterEach(() => {
  vi.unstubAllGlobals();
  server?.close();
  server = null;
});

/** Start an HTTP server; return its origin. */
async function startServer(listener: RequestListener): Promise<string> {
  server = createServer(listener);
  await new Promise<void>((done) => server?.listen(0, "127.0.0.1", done));
  return `http://127.0.0.1:${(server.address() as AddressInfo).port}`;
}

/** Enforce CORS for a page of `SITE` as a browser does; Node does not. */
function stubBrowserFetch(): void {
  const nodeFetch = fetch;
  vi.stubGlobal("fetch", async (url: string, options: RequestInit) => {
    const response = await nodeFetch(url, { ...options, headers: { Origin: SITE } });
    if (options.mode === "cors" && response.headers.get("access-control-allow-origin") !== SITE)
      throw new TypeError("Failed to fetch");
    return response;
  });
}

test("there is no diagnosis if the server allows the site", async () => {
  stubBrowserFetch();
  const url = await startServer((_, answer) =>
    answer.writeHead(200, { "Access-Control-Allow-Origin": SITE }).end("{}"),
  );
  expect(await diagnoseUnreachable(url, SITE)).toBeNull();
});

test("site that is not allowed differs from an unreachable server", async () => {
  stubBrowserFetch();
  const url = await startServer((_, answer) => answer.end("{}"));
  expect(await diagnoseUnreachable(url, SITE)).toMatchObject({
    isFinal: true,
    text: expect.stringContaining(`BUNRAKU_ORIGINS=${SITE}`),
  });
  expect(await diagnoseUnreachable(url, "null")).toMatchObject({
    isFinal: true,
    text: expect.stringContaining("opened from a file"),
  });
  await new Promise((done) => {
    server?.closeAllConnections();
    server?.close(done);
  });
  expect(await diagnoseUnreachable(url, SITE)).toMatchObject({ title: "The stage does not answer", isFinal: false });
});

test("https page cannot use an http server on another machine", async () => {
  vi.stubGlobal("fetch", () => Promise.reject(new TypeError("Failed to fetch")));
  expect(await diagnoseUnreachable("http://stage.example", SITE)).toMatchObject({
    isFinal: true,
    text: expect.stringContaining("https"),
  });
  expect(await diagnoseUnreachable("http://localhost:8000", SITE)).toMatchObject({ isFinal: false });
  expect(await diagnoseUnreachable("http://localhost:8000", SITE, await loadJapaneseTranslator())).toMatchObject({
    title: "舞台が応答しません",
  });
});
