/** Test suites that run in Chromium against a server. Each suite has a browser and a server to itself. */
import type { Browser, BrowserContextOptions, Page } from "playwright-core";
import { afterAll, beforeAll, describe, onTestFinished } from "vitest";
import { chromiumPath, launchChromium } from "./chromium";
import { type RunningServer, type ServerOptions, startServer } from "./server";

/** Time limit of every wait on a page, in milliseconds. It is generous because Chromium renders in software. */
export const PAGE_TIMEOUT_MS = 90_000;

export interface OpenOptions extends BrowserContextOptions {
  /** Called with the page before it navigates. */
  before?: (page: Page) => Promise<unknown>;
}

export interface BrowserFixture {
  /** Base URL of the server, without a trailing slash. */
  readonly url: string;
  /**
   * Open a page with separate storage at `address`, relative to the server's URL. It is closed when the test ends. An
   * uncaught error in the page fails the test.
   */
  open(address?: string, options?: OpenOptions): Promise<Page>;
}

interface SuiteOptions extends ServerOptions {
  /** Command line options of the browser. */
  browser?: string[];
  /** Time limit of each test, in milliseconds. */
  timeout?: number;
}

const executablePath = chromiumPath();
if (!executablePath && process.env["CI"])
  throw new Error("Chromium not found. The browser tests must run in CI: install Chromium.");

/** Define a suite of browser tests. Where Chromium is not installed, it is skipped with a warning. */
export function describeInBrowser(
  name: string,
  { browser: flags = [], timeout = 2 * PAGE_TIMEOUT_MS, ...options }: SuiteOptions,
  defineTests: (fixture: BrowserFixture) => void,
): void {
  if (!executablePath) console.warn(`browser tests of ${name} skipped: Chromium is not installed`);
  describe.skipIf(!executablePath)(name, { timeout }, () => {
    let server: RunningServer;
    let browser: Browser;

    beforeAll(async () => {
      [server, browser] = await Promise.all([startServer(options), launchChromium(executablePath ?? "", ...flags)]);
      // The first server of a run encodes the demo.
    }, 2 * PAGE_TIMEOUT_MS);
    afterAll(async () => {
      await browser?.close();
      await server?.stop();
    }, PAGE_TIMEOUT_MS);

    defineTests({
      get url() {
        return server.url;
      },
      async open(address = "", { before, ...contextOptions } = {}) {
        // A small viewport, because Chromium renders in software.
        const page = await browser.newPage({ viewport: { width: 760, height: 480 }, ...contextOptions });
        onTestFinished(() => page.close());
        page.setDefaultTimeout(PAGE_TIMEOUT_MS);
        page.on("pageerror", (error) => {
          throw error;
        });
        await before?.(page);
        await page.goto(new URL(address, server.url).href);
        return page;
      },
    });
  });
}
