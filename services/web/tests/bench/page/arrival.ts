/** When the puppet is there, and what was loaded until it can be pulled: cases `arrival` and `line`. */
import { gzipSync } from "node:zlib";
import type { Page } from "playwright-core";
import { danced, holds, LEFT_HAND, welcomed } from "../../browser/inside";
import { percentile, rounded, visit, type Bench, type Figures } from "./bench";

declare global {
  interface Window {
    /** When the graphics had drawn the puppet's first pose, milliseconds since the navigation began; noted by `watch`. */
    firstPaint?: number;
  }
}

const VISITS = 5;
/** The emulated line, both ways; its round trip is 100 ms. */
const LINE = { offline: false, latency: 100, downloadThroughput: 125_000, uploadThroughput: 125_000 };

/** Case arrival. */
export async function arrival(bench: Bench): Promise<Figures> {
  const paints: number[] = [];
  for (let nth = 0; nth < VISITS; nth++) paints.push(await visit(bench, {}, ({ page }) => painted(page, bench.url)));
  bench.note(`first paints, s: ${paints.map((paint) => rounded(paint, 2)).join(", ")}`);
  return { first_paint_s: rounded(percentile(paints, 50), 2), ...(await weight(bench)) };
}

/** Case line. */
export async function line(bench: Bench): Promise<Figures> {
  const paints: number[] = [];
  for (let nth = 0; nth < 3; nth++) {
    const paint = await visit(bench, {}, async ({ page, protocol }) => {
      await protocol.send("Network.enable");
      await protocol.send("Network.emulateNetworkConditions", LINE);
      return painted(page, bench.url);
    });
    paints.push(paint);
  }
  bench.note(`first paints on 1 Mbit/s, s: ${paints.map((paint) => rounded(paint, 2)).join(", ")}`);
  return { first_paint_1mbit_s: rounded(percentile(paints, 50), 2) };
}

/** Seconds until a page has drawn the puppet. */
async function painted(page: Page, url: string): Promise<number> {
  await page.addInitScript(watch);
  await page.goto(url, { waitUntil: "commit" });
  await page.waitForFunction(() => window.firstPaint !== undefined);
  return (await page.evaluate(() => window.firstPaint ?? NaN)) / 1000;
}

/** In the page: notes when the graphics are done with the first frame that has the puppet in it. */
function watch(): void {
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
async function weight(bench: Bench): Promise<Figures> {
  const loaded = await visit(bench, {}, async ({ page }) => {
    await page.goto(bench.url);
    await danced(page);
    await welcomed(page);
    await page.keyboard.press("Digit2");
    await holds(page, LEFT_HAND);
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
    bench.note(`loaded: ${new URL(address).pathname.slice(8)} ${rounded(size / 1000)} kB`);
  }
  return { js_gzip_kb: rounded(sizes.js / 1000), fonts_kb: rounded(sizes.woff2 / 1000) };
}
