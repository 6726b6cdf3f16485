/** What every case of `make bench-page` has: the server, Chromium, and pages that nothing was kept for. */
import type { BrowserContextOptions, CDPSession, Page } from "playwright-core";
import { launch } from "../../browser/chromium";

/** By name; whole lists go to the table alone. */
export type Figures = Record<string, number>;

export interface Bench {
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
const PATIENCE = 120_000;

/**
 * Calls `use` with a page of a browser started for it: nothing of ours was ever there, whether fetched or compiled. That it can
 * draw has been tried, as a browser that people have open has its graphics process.
 */
export async function visit<T>({ chromium }: Bench, options: BrowserContextOptions, use: (visit: Visit) => Promise<T>): Promise<T> {
  const browser = await launch(chromium);
  try {
    const blank = await browser.newPage();
    await blank.evaluate(() => document.createElement("canvas").getContext("webgl2")?.finish());
    const page = await browser.newPage({ viewport: { width: 760, height: 480 }, colorScheme: "dark", ...options });
    page.setDefaultTimeout(PATIENCE);
    return await use({ page, protocol: await page.context().newCDPSession(page) });
  } finally {
    await browser.close();
  }
}

/** The least value that so many of a hundred are not above. */
export function percentile(values: readonly number[], hundredths: number): number {
  const sorted = [...values].sort((one, other) => one - other);
  return sorted[Math.max(0, Math.ceil((hundredths / 100) * sorted.length) - 1)] ?? NaN;
}

export function rounded(value: number, digits = 1): number {
  return Number(value.toFixed(digits));
}
