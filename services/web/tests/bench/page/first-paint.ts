/** When the puppet is there, and what was loaded until it can be pulled: cases `arrival` and `line`. */
import { gzipSync } from "node:zlib";
import type { Page } from "playwright-core";
import { LEFT_HAND, waitForFirstPose, waitForHold, waitForWelcome } from "../../browser/page-probe";
import { type BenchContext, type BenchFigures, percentile, roundTo, withPage } from "./bench";

declare global {
  interface Window {
    /**
     * When the graphics had drawn the puppet's first pose, milliseconds since the navigation began; noted by `watch`.
     */
    firstPaint?: number;
  }
}

const VISIT_COUNT = 5;
/** The emulated line, both ways; its round trip is 100 ms. */
const EMULATED_NETWORK = { offline: false, latency: 100, downloadThroughput: 125_000, uploadThroughput: 125_000 };

/** Case arrival. */
export async function benchFirstPaint(bench: BenchContext): Promise<BenchFigures> {
  const paints: number[] = [];
  for (let nth = 0; nth < VISIT_COUNT; nth++)
    paints.push(await withPage(bench, {}, ({ page }) => measureFirstPaint(page, bench.url)));
  bench.note(`first paints, s: ${paints.map((paint) => roundTo(paint, 2)).join(", ")}`);
  return { first_paint_s: roundTo(percentile(paints, 50), 2), ...(await measureDownloads(bench)) };
}

/** Case line. */
export async function benchConstrainedFirstPaint(bench: BenchContext): Promise<BenchFigures> {
  const paints: number[] = [];
  for (let nth = 0; nth < 3; nth++) {
    const paint = await withPage(bench, {}, async ({ page, protocol }) => {
      await protocol.send("Network.enable");
      await protocol.send("Network.emulateNetworkConditions", EMULATED_NETWORK);
      return measureFirstPaint(page, bench.url);
    });
    paints.push(paint);
  }
  bench.note(`first paints on 1 Mbit/s, s: ${paints.map((paint) => roundTo(paint, 2)).join(", ")}`);
  return { first_paint_1mbit_s: roundTo(percentile(paints, 50), 2) };
}

/** Seconds until a page has drawn the puppet. */
async function measureFirstPaint(page: Page, url: string): Promise<number> {
  await page.addInitScript(watchFirstPaint);
  await page.goto(url, { waitUntil: "commit" });
  await page.waitForFunction(() => window.firstPaint !== undefined);
  return (await page.evaluate(() => window.firstPaint ?? NaN)) / 1000;
}

/** In the page: notes when the graphics are done with the first frame that has the puppet in it. */
function watchFirstPaint(): void {
  let drawn: (() => boolean) | null = null;
  const look = () => {
    const { stage } = window.bunraku ?? {};
    if (drawn?.()) window.firstPaint ??= performance.now();
    if (!stage || drawn) return;
    const { renderer } = stage;
    const render = renderer.render;
    drawn = () => false;
    renderer.render = (scene, camera) => {
      render.call(renderer, scene, camera);
      if (scene !== stage.scene || !stage.puppet?.group.visible) return;
      renderer.render = render;
      const gl = renderer.getContext() as WebGL2RenderingContext;
      const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0) as WebGLSync;
      gl.flush();
      drawn = () => gl.getSyncParameter(fence, gl.SYNC_STATUS) === gl.SIGNALED;
    };
  };
  // before each frame too: it may take long, and a timer's turn comes after it
  const request = window.requestAnimationFrame.bind(window);
  window.requestAnimationFrame = (callback) =>
    request((time) => {
      look();
      callback(time);
    });
  const keepLooking = () => {
    look();
    if (window.firstPaint === undefined) setTimeout(keepLooking);
  };
  keepLooking();
}

/** Scripts and fonts that a page has fetched by the time that a hand was taken, each as it comes over a line. */
async function measureDownloads(bench: BenchContext): Promise<BenchFigures> {
  const loaded = await withPage(bench, {}, async ({ page }) => {
    await page.goto(bench.url);
    await waitForFirstPose(page);
    await waitForWelcome(page);
    await page.keyboard.press("Digit2");
    await waitForHold(page, LEFT_HAND);
    await page.waitForLoadState("networkidle");
    return page.evaluate(() => performance.getEntriesByType("resource").map(({ name }) => name));
  });
  const sizes = { js: 0, woff2: 0 };
  for (const address of new Set(loaded)) {
    const [, kind] = /\.(js|woff2)$/.exec(new URL(address).pathname) ?? [];
    if (kind !== "js" && kind !== "woff2") continue;
    const body = Buffer.from(await (await fetch(address)).arrayBuffer());
    const size = (kind === "js" ? gzipSync(body, { level: 9 }) : body).length;
    sizes[kind] += size;
    bench.note(`loaded: ${new URL(address).pathname.slice(8)} ${roundTo(size / 1000)} kB`);
  }
  return { js_gzip_kb: roundTo(sizes.js / 1000), fonts_kb: roundTo(sizes.woff2 / 1000) };
}
