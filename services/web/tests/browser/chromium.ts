/** Chromium with software rendering, so that the tests run on machines without a graphics processor. */
import { existsSync } from "node:fs";
import { type Browser, type BrowserServer, type LaunchOptions, chromium as playwright } from "playwright-core";

/** Time limit of every wait on a page, in milliseconds. It is generous because Chromium renders in software. */
export const PAGE_TIMEOUT_MS = 120_000;

/** Return the path of the installed Chromium (or `CHROMIUM`), or null if there is none. */
export function chromiumPath(): string | null {
  const paths = [process.env["CHROMIUM"], "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];
  return paths.find((path): path is string => path !== undefined && existsSync(path)) ?? null;
}

export function launchChromium(executablePath: string, ...flags: string[]): Promise<Browser> {
  return playwright.launch(launchOptions(executablePath, flags));
}

/**
 * Switches that save time: no window has an address bar that is a page of its own. Only the last list of features
 * counts, so this one repeats those of Playwright's that matter to the tests.
 */
const LIGHT_SWITCHES = [
  "--disable-features=WebUIOmniboxPopup,WebUIOmniboxFullPopup,WebUIOmniboxAimPopup,HttpsUpgrades," +
    "HttpsFirstBalancedModeAutoEnable,MediaRouter,OptimizationHints,PaintHolding,ThirdPartyStoragePartitioning",
];

/** Launch a browser that several processes can use at the same time (`connectToChromium`). */
export function launchSharedChromium(executablePath: string, flags: readonly string[]): Promise<BrowserServer> {
  return playwright.launchServer(launchOptions(executablePath, [...LIGHT_SWITCHES, ...flags]));
}

export function connectToChromium(endpoint: string): Promise<Browser> {
  return playwright.connect(endpoint);
}

function launchOptions(executablePath: string, flags: readonly string[]): LaunchOptions {
  return {
    executablePath,
    args: [
      "--no-sandbox",
      "--use-gl=angle",
      "--use-angle=swiftshader",
      "--enable-unsafe-swiftshader",
      // SwiftShader draws WebGL alone, not the page around it, as where Chromium finds no graphics processor.
      "--disable-gpu-compositing",
      "--disable-quic",
      "--no-first-run",
      "--disable-background-networking",
      "--disable-component-update",
      "--disable-sync",
      // Some tests use two pages at once: neither may be throttled as a background page.
      "--disable-backgrounding-occluded-windows",
      "--disable-renderer-backgrounding",
      "--disable-background-timer-throttling",
      ...flags,
    ],
  };
}
