/** Chromium drawing in software, so that it runs where there is no graphics processor. */
import { existsSync } from "node:fs";
import { type Browser, chromium as playwright } from "playwright-core";

/** The Chromium of this machine, if it has one. */
export function chromiumPath(): string | null {
  const places = [process.env["CHROMIUM"], "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];
  return places.find((place): place is string => place !== undefined && existsSync(place)) ?? null;
}

export function launchChromium(executablePath: string, ...more: string[]): Promise<Browser> {
  return playwright.launch({
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
      // Two pages are watched at once; neither may be put to sleep for standing behind the other.
      "--disable-backgrounding-occluded-windows",
      "--disable-renderer-backgrounding",
      "--disable-background-timer-throttling",
      ...more,
    ],
  });
}
