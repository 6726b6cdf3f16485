/** Tests in a real browser over a real server, both of which a test file has to itself. */
import type { Browser, BrowserContextOptions, Page } from "playwright-core";
import { afterAll, beforeAll, describe, onTestFinished } from "vitest";
import { chromiumPath, launchChromium } from "./chromium";
import { type RunningServer, type ServerOptions, startServer } from "./server";

/** Milliseconds in which whatever is waited for must come: pictures are drawn in software. */
export const PAGE_TIMEOUT_MS = 90_000;

/** What a page is opened in: `before` is called with it before it goes to its address. */
export interface OpenOptions extends BrowserContextOptions {
  before?: (page: Page) => Promise<unknown>;
}

export interface BrowserFixture {
  /** The server's, without a slash at its end. */
  readonly url: string;
  /** A page of its own storage, at an address from the server's on, until the test is over. What fails in it fails the tests. */
  open(address?: string, opening?: OpenOptions): Promise<Page>;
}

interface SuiteOptions extends ServerOptions {
  /** Options of the browser's command line. */
  browser?: string[];
  /** Milliseconds that a test may take. */
  timeout?: number;
}

const executablePath = chromiumPath();
if (!executablePath && process.env["CI"]) throw new Error("the browser tests must run in CI: install Chromium");

/** A suite of `tests`, which is left out, and says so, where there is no Chromium. */
export function describeInBrowser(
  name: string,
  { browser: flags = [], timeout = 2 * PAGE_TIMEOUT_MS, ...options }: SuiteOptions,
  tests: (own: BrowserFixture) => void,
): void {
  if (!executablePath) console.warn(`browser tests of ${name} skipped: Chromium is not installed`);
  describe.skipIf(!executablePath)(name, { timeout }, () => {
    let server: RunningServer;
    let browser: Browser;

    beforeAll(async () => {
      [server, browser] = await Promise.all([startServer(options), launchChromium(executablePath ?? "", ...flags)]);
      // it makes our dance and its music first
    }, 2 * PAGE_TIMEOUT_MS);
    afterAll(async () => {
      await browser?.close();
      await server?.stop();
    }, PAGE_TIMEOUT_MS);

    tests({
      get url() {
        return server.url;
      },
      async open(address = "", { before, ...opening } = {}) {
        // small, as the picture is drawn in software
        const page = await browser.newPage({ viewport: { width: 760, height: 480 }, ...opening });
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
