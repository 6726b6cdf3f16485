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

/** The address of a real server. */
async function startServer(answer: RequestListener): Promise<string> {
  server = createServer(answer);
  await new Promise<void>((done) => server?.listen(0, "127.0.0.1", done));
  return `http://127.0.0.1:${(server.address() as AddressInfo).port}`;
}

/** Reads as a browser lets a page of `SITE` read: Node reads whatever comes. */
function stubBrowserFetch(): void {
  const plain = fetch;
  vi.stubGlobal("fetch", async (url: string, options: RequestInit) => {
    const answer = await plain(url, { ...options, headers: { Origin: SITE } });
    if (options.mode === "cors" && answer.headers.get("access-control-allow-origin") !== SITE)
      throw new TypeError("Failed to fetch");
    return answer;
  });
}

test("of a server that lets this site in there is nothing to say", async () => {
  stubBrowserFetch();
  const url = await startServer((_, answer) =>
    answer.writeHead(200, { "Access-Control-Allow-Origin": SITE }).end("{}"),
  );
  expect(await diagnoseUnreachable(url, SITE)).toBeNull();
});

test("one that answers, but not to this site, is told from one that does not answer", async () => {
  stubBrowserFetch();
  const url = await startServer((_, answer) => answer.end("{}"));
  expect(await diagnoseUnreachable(url, SITE)).toMatchObject({
    final: true,
    text: expect.stringContaining(`BUNRAKU_ORIGINS=${SITE}`),
  });
  expect(await diagnoseUnreachable(url, "null")).toMatchObject({
    final: true,
    text: expect.stringContaining("opened from a file"),
  });
  await new Promise((done) => {
    server?.closeAllConnections();
    server?.close(done);
  });
  expect(await diagnoseUnreachable(url, SITE)).toMatchObject({ title: "The stage does not answer", final: false });
});

test("a page that came over https speaks with no other machine that has none", async () => {
  vi.stubGlobal("fetch", () => Promise.reject(new TypeError("Failed to fetch")));
  expect(await diagnoseUnreachable("http://stage.example", SITE)).toMatchObject({
    final: true,
    text: expect.stringContaining("https"),
  });
  expect(await diagnoseUnreachable("http://localhost:8000", SITE)).toMatchObject({ final: false });
  expect(await diagnoseUnreachable("http://localhost:8000", SITE, await loadJapaneseTranslator())).toMatchObject({
    title: "舞台が応答しません",
  });
});
