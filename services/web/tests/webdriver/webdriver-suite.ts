/** Test suites that run in Firefox and WebKitGTK. */
import { randomUUID } from "node:crypto";
import { afterAll, beforeAll, beforeEach, describe, expect, onTestFinished } from "vitest";
import { getShared } from "../browser/shared-endpoint";
import type { SharedServer } from "../browser/shared-resources";
import type { Browser, BrowserSession, BrowserWindow, SessionOptions, WindowSize } from "./browser";
import { WAIT_TIMEOUT_MS } from "./browser";
import { startFirefox } from "./firefox";
import { evaluate } from "./page";
import { type ProbeProxy, startProbeProxy } from "./probe-proxy";
import { createProbes } from "./probes";
import { findProgram } from "./processes";
import { startWebKit } from "./webkit";

/** Small, because the browsers render in software. */
const WINDOW_SIZE: WindowSize = { width: 600, height: 420 };

const BROWSERS = {
  Firefox: { programs: ["firefox-esr", "Xvfb", "pulseaudio"], start: startFirefox },
  WebKitGTK: { programs: ["WebKitWebDriver", "Xvfb"], start: startWebKit },
};

export type BrowserName = keyof typeof BROWSERS;

/** State of a session on the server. */
export interface SessionState {
  playing: boolean;
  puppeteers: { id: string; name: string }[];
  /** Puppeteer that holds each limb. */
  limbs: (string | null)[];
}

export interface WebDriverFixture {
  /** Base URL of the server, without a trailing slash. */
  readonly url: string;
  /** Session of the present test, which plays the demo and is paused at its start. */
  readonly session: string;
  /** Name of the browser. */
  readonly browser: BrowserName;
  /**
   * Open a window at `address`, relative to the page of the test's session. Windows of a test share their storage. An
   * error in a page fails the test.
   */
  open(address?: string): Promise<BrowserWindow>;
  /** Open the browser's session of the present test with other options. */
  useSession(options: SessionOptions): Promise<void>;
  /** In the present test, call `remove` in every page and worker before their scripts: it takes features away. */
  removeFeatures(remove: () => void): void;
  /** Play the test's session. */
  play(): Promise<void>;
  /** Return the folder of the downloads. */
  downloads(): string;
  state(): Promise<SessionState>;
  /** Publish a page on a site that may embed the server's stages, and return its URL. */
  publish(html: string): Promise<string>;
}

/** Define a suite for a browser. Where the browser is not installed, it is skipped with a warning; in CI it fails. */
export function describeInWebDriver(name: BrowserName, defineTests: (fixture: WebDriverFixture) => void): void {
  const { programs, start } = BROWSERS[name];
  const missing = programs.filter((program) => findProgram(program) === null);
  if (missing.length > 0) {
    const reason = `${missing.join(", ")} not found`;
    if (process.env["CI"]) throw new Error(`${reason}. The tests of ${name} must run in CI: install it.`);
    console.warn(`tests of ${name} skipped: ${reason}`);
  }
  describe.skipIf(missing.length > 0)(name, { timeout: 4 * WAIT_TIMEOUT_MS }, () => {
    let server: SharedServer;
    let proxy: ProbeProxy;
    let browser: Browser;
    let browserSession: BrowserSession | null = null;
    let session = "";
    let probes = createProbes(() => undefined);

    beforeAll(async () => {
      server = await getShared<SharedServer>("/server?kind=patient");
      proxy = await startProbeProxy(server.url, () => probes);
      browser = await start(findProgram(programs[0]) ?? "");
    }, 4 * WAIT_TIMEOUT_MS);
    afterAll(async () => {
      await browser?.close();
      await proxy?.stop();
    }, WAIT_TIMEOUT_MS);
    beforeEach(async () => {
      session = (await request<{ id: string }>("POST", "/v1/sessions", { motion: server.motion })).id;
      await request("PATCH", `/v1/sessions/${session}`, { playing: false, position: 0 });
      probes = createProbes(() => undefined);
    });

    async function request<T>(method: string, path: string, body?: unknown): Promise<T> {
      const response = await fetch(server.url + path, {
        method,
        headers: { "Content-Type": "application/json" },
        body: body === undefined ? null : JSON.stringify(body),
      });
      if (!response.ok) throw new Error(`${method} ${path}: ${response.status} ${await response.text()}`);
      return (await response.json()) as T;
    }

    async function useSession(options: SessionOptions): Promise<BrowserSession> {
      const opened = await browser.openSession(options);
      browserSession = opened;
      onTestFinished(async () => {
        browserSession = null;
        await opened.close();
        expect(opened.errors.join("\n"), "errors on the console").toBe("");
      });
      return opened;
    }

    defineTests({
      browser: name,
      get url() {
        return proxy.url;
      },
      get session() {
        return session;
      },
      async open(address = "") {
        const url = new URL(address, `${proxy.url}/`);
        if (url.origin === proxy.url && url.pathname === "/" && !url.searchParams.has("session"))
          url.searchParams.set("session", session);
        const window = await (browserSession ?? (await useSession({}))).open(url.href, WINDOW_SIZE);
        onTestFinished(async () => {
          const errors = await evaluate(window, () => globalThis.window.probe.errors);
          expect(errors.join("\n"), "errors of the page").toBe("");
        });
        return window;
      },
      useSession: async (options) => void (await useSession(options)),
      removeFeatures: (remove) => void (probes = createProbes(remove)),
      play: () => request("PATCH", `/v1/sessions/${session}`, { playing: true }),
      downloads: () => browserSession?.downloads ?? "",
      state: () => request("GET", `/v1/sessions/${session}`),
      async publish(html) {
        const path = `/${randomUUID()}`;
        await fetch(server.site.origin + path, { method: "PUT", body: `<script>${probes.page}</script>${html}` });
        return server.site.origin + path;
      },
    });
  });
}
