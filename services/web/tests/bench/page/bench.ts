/** Common parts of the cases of `make bench-page`. */
import type { Browser, BrowserContextOptions, CDPSession, Page } from "playwright-core";
import { launchChromium, PAGE_TIMEOUT_MS } from "../../browser/chromium";

/** Figures by name. Lists are reported as notes instead. */
export type BenchFigures = Record<string, number>;

export interface BenchContext {
  /** Base URL of a server with the demo's motion on the stage. */
  readonly url: string;
  /** Path of Chromium. */
  readonly chromium: string;
  /** Duration of the case `memory`, in minutes. */
  readonly minutes: number;
  /** Print a line of text below the table. */
  note(text: string): void;
}

export interface Visit {
  page: Page;
  protocol: CDPSession;
}

/** An idle browser uses less than this share of a processor over `IDLE_WINDOW_S` seconds. */
const MAX_IDLE_LOAD = 0.05;
const IDLE_WINDOW_S = 0.5;

/**
 * Call `use` with a page of a newly started browser without caches. WebGL is initialised first, because the browser of
 * a user already runs its GPU process.
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
 * Wait until the browser is idle. At its start Chromium loads internal pages for its address bar, which uses a
 * processor for half a second. The browser of a user has done this long before.
 */
async function waitForIdleBrowser(browser: Browser): Promise<void> {
  const protocol = await browser.newBrowserCDPSession();
  let before = -Infinity;
  for (;;) {
    const { processInfo } = await protocol.send("SystemInfo.getProcessInfo");
    const cpuTimeS = processInfo.reduce((sum, { cpuTime }) => sum + cpuTime, 0);
    if (cpuTimeS - before < MAX_IDLE_LOAD * IDLE_WINDOW_S) break;
    before = cpuTimeS;
    await new Promise((done) => setTimeout(done, IDLE_WINDOW_S * 1000));
  }
  await protocol.detach();
}

/** Return the smallest value that at least `percent` % of the values do not exceed. */
export function percentile(values: readonly number[], percent: number): number {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.max(0, Math.ceil((percent / 100) * sorted.length) - 1)] ?? NaN;
}

export function roundTo(value: number, digits = 1): number {
  return Number(value.toFixed(digits));
}
