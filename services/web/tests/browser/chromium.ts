/** Chromium with software rendering, so that the tests run on machines without a graphics processor. */
import { existsSync } from "node:fs";
import { type Browser, type BrowserServer, type LaunchOptions, chromium as playwright } from "playwright-core";

/** Return the path of the installed Chromium (or `CHROMIUM`), or null if there is none. */
export function chromiumPath(): string | null {
  const paths = [process.env["CHROMIUM"], "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];
  return paths.find((path): path is string => path !== undefined && existsSync(path)) ?? null;
}

export function launchChromium(executablePath: string, ...flags: string[]): Promise<Browser> {
  return playwright.launch(launchOptions(executablePath, flags));
}

/** Launch a browser that several processes can use at the same time (`connectToChromium`). */
export function launchSharedChromium(executablePath: string, flags: readonly string[]): Promise<BrowserServer> {
  // WebGL is drawn by SwiftShader, and the page around it by the processor itself: three times as many frames.
  return playwright.launchServer(launchOptions(executablePath, ["--disable-gpu-compositing", ...flags]));
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
