/** Tests in a real browser over a real server, both of which a test file has to itself. */
import type { Browser, BrowserContextOptions, Page } from "playwright-core";
import { afterAll, beforeAll, describe, onTestFinished } from "vitest";
import { chromium, launch } from "./chromium";
import { startServer, type RunningServer, type ServerOptions } from "./server";

/** Milliseconds in which whatever is waited for must come: pictures are drawn in software. */
export const PATIENCE = 90_000;

/** What a page is opened in: `before` is called with it before it goes to its address. */
export interface Opening extends BrowserContextOptions {
  before?: (page: Page) => Promise<unknown>;
}

export interface Own {
  /** The server's, without a slash at its end. */
  readonly url: string;
  /** A page of its own storage, at an address from the server's on, until the test is over. What fails in it fails the tests. */
  open(address?: string, opening?: Opening): Promise<Page>;
}

interface Options extends ServerOptions {
  /** Options of the browser's command line. */
  browser?: string[];
  /** Milliseconds that a test may take. */
  timeout?: number;
}

const path = chromium();
if (!path && process.env["CI"]) throw new Error("the browser tests must run in CI: install Chromium");

/** A suite of `tests`, which is left out, and says so, where there is no Chromium. */
export function describeInBrowser(name: string, { browser: flags = [], timeout = 2 * PATIENCE, ...options }: Options, tests: (own: Own) => void): void {
  if (!path) console.warn(`browser tests of ${name} skipped: Chromium is not installed`);
  describe.skipIf(!path)(name, { timeout }, () => {
    let server: RunningServer;
    let browser: Browser;

    beforeAll(async () => {
      [server, browser] = await Promise.all([startServer(options), launch(path ?? "", ...flags)]);
      // it makes our dance and its music first
    }, 2 * PATIENCE);
    afterAll(async () => {
      await browser?.close();
      await server?.stop();
    }, PATIENCE);

    tests({
      get url() {
        return server.url;
      },
      async open(address = "", { before, ...opening } = {}) {
        // small, as the picture is drawn in software
        const page = await browser.newPage({ viewport: { width: 760, height: 480 }, ...opening });
        onTestFinished(() => page.close());
        page.setDefaultTimeout(PATIENCE);
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
