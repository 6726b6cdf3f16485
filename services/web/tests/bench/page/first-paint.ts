/** Cases `arrival` and `line`: time to the first paint of the puppet, and size of the scripts and fonts. */
import type { Page } from "playwright-core";
import { evaluateInEngine } from "../../browser/engine-probe";
import { LEFT_HAND, tapKey, waitForFirstPose, waitForHold, waitForWelcome } from "../../browser/page-probe";
import { type BenchContext, type BenchFigures, percentile, roundTo, withPage } from "./bench";

declare global {
  /** Time of the puppet's first paint in milliseconds since the epoch. Set by `watchFirstPaint`. */
  var firstPaint: Promise<number>;
}

const VISIT_COUNT = 5;
/** 1 Mbit/s in both directions with an RTT of 100 ms. */
const EMULATED_NETWORK = { offline: false, latency: 100, downloadThroughput: 125_000, uploadThroughput: 125_000 };

/** Run the case `arrival`. */
export async function benchFirstPaint(bench: BenchContext): Promise<BenchFigures> {
  const paints: number[] = [];
  for (let nth = 0; nth < VISIT_COUNT; nth++)
    paints.push(await withPage(bench, {}, ({ page }) => measureFirstPaint(page, bench.url)));
  bench.note(`first paints, s: ${paints.map((paint) => roundTo(paint, 2)).join(", ")}`);
  return { first_paint_s: roundTo(percentile(paints, 50), 2), ...(await measureDownloads(bench)) };
}

/** Run the case `line`. */
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

/** Return the time until a page has drawn the puppet, in seconds. */
async function measureFirstPaint(page: Page, url: string): Promise<number> {
  await page.addInitScript(watchFirstPaint);
  const paintInWorker = new Promise<number>((resolve) =>
    page.on("worker", (worker) => {
      const paint = worker.evaluate(watchFirstPaint).then(() => worker.evaluate(() => globalThis.firstPaint));
      // A worker without a stage never reports a paint and ends with the page.
      paint.then(resolve, () => undefined);
    }),
  );
  await page.goto(url, { waitUntil: "commit" });
  const paint = await Promise.race([page.evaluate(() => globalThis.firstPaint), paintInWorker]);
  return (paint - (await page.evaluate(() => performance.timeOrigin))) / 1000;
}

/** In the page and in its workers: observe when the GPU has completed the first frame with the puppet. */
function watchFirstPaint(): void {
  let isDrawn: (() => boolean) | null = null;
  let isReported = false;
  let report: (time: number) => void;
  globalThis.firstPaint = new Promise((resolve) => (report = resolve));
  const check = () => {
    const { stage } = globalThis.bunraku ?? {};
    if (!isReported && isDrawn?.()) {
      isReported = true;
      report(performance.timeOrigin + performance.now());
    }
    if (!stage || isDrawn) return;
    const { renderer } = stage;
    const render = renderer.render;
    isDrawn = () => false;
    renderer.render = (scene, camera) => {
      render.call(renderer, scene, camera);
      if (scene !== stage.scene || !stage.puppet?.group.visible) return;
      renderer.render = render;
      const gl = renderer.getContext() as WebGL2RenderingContext;
      const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0) as WebGLSync;
      gl.flush();
      isDrawn = () => gl.getSyncParameter(fence, gl.SYNC_STATUS) === gl.SIGNALED;
    };
  };
  // Check before each frame too: a long frame delays the timer.
  const request = globalThis.requestAnimationFrame.bind(globalThis);
  globalThis.requestAnimationFrame = (callback) =>
    request((time) => {
      check();
      callback(time);
    });
  const poll = () => {
    check();
    if (!isReported) setTimeout(poll);
  };
  poll();
}

/**
 * Return the bytes of the scripts and fonts that a page loads until a hand is held, as the server sends them to a
 * browser that accepts gzip.
 */
async function measureDownloads(bench: BenchContext): Promise<BenchFigures> {
  const urls = await withPage(bench, {}, async ({ page }) => {
    await page.goto(bench.url);
    await waitForFirstPose(page);
    await waitForWelcome(page);
    await tapKey(page, "Digit2");
    await waitForHold(page, LEFT_HAND);
    await page.waitForLoadState("networkidle");
    const listUrls = () => performance.getEntriesByType("resource").map(({ name }) => name);
    return [
      ...(await page.evaluate(listUrls)),
      ...(await evaluateInEngine(page, listUrls)),
      ...page.workers().map((worker) => worker.url()),
    ];
  });
  const sizes = { js: 0, woff2: 0 };
  for (const url of new Set(urls)) {
    const [, kind] = /\.(js|woff2)$/.exec(new URL(url).pathname) ?? [];
    if (kind !== "js" && kind !== "woff2") continue;
    const response = await fetch(url, { method: "HEAD", headers: { "Accept-Encoding": "gzip" } });
    const size = Number(response.headers.get("content-length"));
    if (!response.ok || !(size > 0)) throw new Error(`The server does not tell the size of ${url}`);
    sizes[kind] += size;
    bench.note(`loaded: ${new URL(url).pathname.slice(8)} ${roundTo(size / 1000)} kB`);
  }
  return { js_gzip_kb: roundTo(sizes.js / 1000), fonts_kb: roundTo(sizes.woff2 / 1000) };
}
