/**
 * Test suites that run in Chromium against a server. They share browsers and servers; each test has its own session.
 */
import { randomUUID } from "node:crypto";
import type { Browser, BrowserContextOptions, Page } from "playwright-core";
import { afterAll, beforeAll, beforeEach, describe, onTestFinished } from "vitest";
import { chromiumPath, connectToChromium, PAGE_TIMEOUT_MS } from "./chromium";
import { type ConnectionProxy, startProxy } from "./connection-proxy";
import { getShared } from "./shared-endpoint";
import type { ServerKind, SharedServer } from "./shared-resources";
import { limitFrameRate } from "./slow-display";

export interface OpenOptions extends BrowserContextOptions {
  /** Called with the page before it navigates. */
  before?: (page: Page) => Promise<unknown>;
}

export interface BrowserFixture extends SharedServer {
  /** Session of the present test, which plays the demo; null on an empty server. */
  readonly session: string | null;
  /**
   * Open a page with separate storage at `address`, relative to the page of the test's session. A first page that
   * prefers reduced motion pauses the session. It is closed when the test ends. An uncaught error in the page fails the
   * test.
   */
  open(address?: string, options?: OpenOptions): Promise<Page>;
  /** Send a file or JSON to the server, as admin if it has access control. Return the body of the response. */
  request<T>(method: string, path: string, body?: RequestBody): Promise<T>;
  /** Start a proxy of the server, which stops when the test ends. It delays WebSockets by up to `maxDelayMs`. */
  proxy(maxDelayMs?: number): Promise<ConnectionProxy>;
  /** Publish a page on the foreign site and return its path. */
  publish(html: string): Promise<string>;
}

type RequestBody = string | Uint8Array<ArrayBuffer> | Record<string, unknown>;

interface SuiteOptions {
  /** Kind of the server. */
  server: ServerKind;
  /** Command line options of the browser. */
  browser?: string[];
  /** Draw at the full frame rate, for tests that measure frames. Other pages draw at 10 Hz. */
  fullFrameRate?: boolean;
  /** Time limit of each test, in milliseconds. */
  timeout?: number;
}

const isInstalled = chromiumPath() !== null;
if (!isInstalled && process.env["CI"])
  throw new Error("Chromium not found. The browser tests must run in CI: install Chromium.");

/** Define a suite of browser tests. Where Chromium is not installed, it is skipped with a warning. */
export function describeInBrowser(
  name: string,
  { server: kind, browser: flags = [], fullFrameRate = false, timeout = 3 * PAGE_TIMEOUT_MS }: SuiteOptions,
  defineTests: (fixture: BrowserFixture) => void,
): void {
  if (!isInstalled) console.warn(`browser tests of ${name} skipped: Chromium is not installed`);
  describe.skipIf(!isInstalled)(name, { timeout }, () => {
    let server: SharedServer;
    let browser: Browser;
    let session: string | null = null;
    /** True until the present test opens a page. */
    let isUnseen = true;

    beforeAll(async () => {
      const options = new URLSearchParams({ worker: process.env["VITEST_POOL_ID"] ?? "" });
      for (const flag of flags) options.append("flag", flag);
      const [shared, endpoint] = await Promise.all([
        getShared<SharedServer>(`/server?kind=${kind}`),
        getShared<string>(`/browser?${options}`),
      ]);
      [server, browser] = [shared, await connectToChromium(endpoint)];
      // The first suite of a run waits until server and browser have started.
    }, 4 * PAGE_TIMEOUT_MS);
    afterAll(() => browser?.close(), PAGE_TIMEOUT_MS);

    beforeEach(async () => {
      const { motion } = server;
      session = motion && (await request<{ id: string }>("POST", "/v1/sessions", { motion })).id;
      isUnseen = true;
    });

    async function request<T>(method: string, path: string, body?: RequestBody): Promise<T> {
      const isFile = body === undefined || typeof body === "string" || body instanceof Uint8Array;
      const response = await fetch(server.url + path, {
        method,
        headers: {
          ...(isFile ? {} : { "Content-Type": "application/json" }),
          ...(server.tokens ? { Authorization: `Bearer ${server.tokens.admin}` } : {}),
        },
        body: isFile ? (body ?? null) : JSON.stringify(body),
      });
      const content = await response.text();
      if (!response.ok) throw new Error(`${method} ${path}: ${response.status} ${content}`);
      return (content && JSON.parse(content)) as T;
    }

    defineTests({
      get url() {
        return server.url;
      },
      get motion() {
        return server.motion;
      },
      get tokens() {
        return server.tokens;
      },
      get site() {
        return server.site;
      },
      get session() {
        return session;
      },
      request,
      async proxy(maxDelayMs) {
        const proxy = await startProxy(server.url, maxDelayMs);
        onTestFinished(() => proxy.stop());
        return proxy;
      },
      async publish(html) {
        const path = `/${randomUUID()}`;
        await fetch(server.site.origin + path, { method: "PUT", body: html });
        return path;
      },
      async open(address = "", { before, ...contextOptions } = {}) {
        // A small viewport, because Chromium renders in software.
        const page = await browser.newPage({ viewport: { width: 760, height: 480 }, ...contextOptions });
        onTestFinished(() => page.close());
        page.setDefaultTimeout(PAGE_TIMEOUT_MS);
        page.on("pageerror", (error) => {
          throw error;
        });
        if (!fullFrameRate) await limitFrameRate(page);
        await before?.(page);
        const url = pageAddress(address, server.url, session);
        // A page whose address names no session does this itself.
        if (session && isUnseen && contextOptions.reducedMotion === "reduce" && url.includes(session))
          await request("PATCH", `/v1/sessions/${session}`, { playing: false });
        isUnseen = false;
        await page.goto(url);
        return page;
      },
    });
  });
}

/** Return the address of a page. The server's page gets the test's session if it names no other. */
function pageAddress(address: string, server: string, session: string | null): string {
  const url = new URL(address, server);
  const isPage = url.origin === new URL(server).origin && url.pathname === "/";
  if (session && isPage && !url.searchParams.has("session") && !url.searchParams.has("motion"))
    url.searchParams.set("session", session);
  return url.href;
}
