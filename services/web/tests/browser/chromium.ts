/** Chromium drawing in software, so that it runs where there is no graphics processor. */
import { chromium, type Browser } from "playwright-core";

export function launch(executablePath: string, ...more: string[]): Promise<Browser> {
  return chromium.launch({
    executablePath,
    args: [
      "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run",
      "--disable-background-networking", "--disable-component-update", "--disable-sync",
      // Two pages are watched at once; neither may be put to sleep for standing behind the other.
      "--disable-backgrounding-occluded-windows", "--disable-renderer-backgrounding", "--disable-background-timer-throttling",
      ...more,
    ],
  });
}
