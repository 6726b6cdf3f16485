/** What every case of `make bench-page` has: the server, Chromium, and pages that nothing was kept for. */
import type { Browser, BrowserContextOptions, CDPSession, Page } from "playwright-core";
import { launchChromium } from "../../browser/chromium";

/** By name; whole lists go to the table alone. */
export type BenchFigures = Record<string, number>;

export interface BenchContext {
  /** The server's, with our own dance on its stage. */
  readonly url: string;
  /** Where Chromium is. */
  readonly chromium: string;
  /** How long `memory` plays, minutes. */
  readonly minutes: number;
  /** Puts a line under the table. */
  note(line: string): void;
}

export interface Visit {
  page: Page;
  protocol: CDPSession;
}

/** How long a page may take for anything, milliseconds: it is drawn in software. */
const PAGE_TIMEOUT_MS = 120_000;

/** A browser at rest takes less of a processor than this, over so many seconds. */
const MAX_IDLE_LOAD = 0.05;
const IDLE_WINDOW_S = 0.5;

/**
 * Calls `use` with a page of a browser started for it: nothing of ours was ever there, whether fetched or compiled.
 * That it can draw has been tried, as a browser that people have open has its graphics process.
 */
export async function withPage<T>(
  { chromium }: BenchContext,
  options: BrowserContextOptions,
  use: (visit: Visit) => Promise<T>,
): Promise<T> {
  const browser = await launchChromium(chromium);
  try {
    const blank = await browser.newPage();
    await blank.evaluate(() => document.createElement("canvas").getContext("webgl2")?.finish());
    const page = await browser.newPage({ viewport: { width: 760, height: 480 }, colorScheme: "dark", ...options });
    page.setDefaultTimeout(PAGE_TIMEOUT_MS);
    await waitForIdleBrowser(browser);
    return await use({ page, protocol: await page.context().newCDPSession(page) });
  } finally {
    await browser.close();
  }
}

/**
 * Waits until the browser is done with its own start: for each window it loads pages of its own for its address bar,
 * which take a processor for half a second, and which a browser that people have open loaded long ago.
 */
async function waitForIdleBrowser(browser: Browser): Promise<void> {
  const protocol = await browser.newBrowserCDPSession();
  let before = -Infinity;
  for (;;) {
    const { processInfo } = await protocol.send("SystemInfo.getProcessInfo");
    const taken = processInfo.reduce((sum, { cpuTime }) => sum + cpuTime, 0);
    if (taken - before < MAX_IDLE_LOAD * IDLE_WINDOW_S) break;
    before = taken;
    await new Promise((done) => setTimeout(done, IDLE_WINDOW_S * 1000));
  }
  await protocol.detach();
}

/** The least value that so many of a hundred are not above. */
export function percentile(values: readonly number[], hundredths: number): number {
  const sorted = [...values].sort((one, other) => one - other);
  return sorted[Math.max(0, Math.ceil((hundredths / 100) * sorted.length) - 1)] ?? NaN;
}

export function roundTo(value: number, digits = 1): number {
  return Number(value.toFixed(digits));
}
