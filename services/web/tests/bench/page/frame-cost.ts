/** Cases `frames` and `drawing`: cost of a frame while three limbs are controlled. */
import type { Page } from "playwright-core";
import { waitForFirstPose, waitForHold, waitForWelcome } from "../../browser/page-probe";
import { type BenchContext, type BenchFigures, percentile, roundTo, withPage } from "./bench";

declare global {
  interface Window {
    /** Number of frames that have drawn. */
    drawn: number;
  }
}

/** An event of Chromium's trace. Times are in microseconds; `tdur` is the thread's processor time. */
interface TraceEvent {
  name: string;
  tid: number;
  ts: number;
  dur?: number;
  tdur?: number;
}

const CONTROLLED_LIMBS = [0, 1, 3];
const CPU_SLOWDOWN = 4;
const MEASURED_FRAMES = 240;
/** Frames before the measurement, in which the script is compiled. */
const WARM_UP_FRAMES = 60;
const VIEWPORT = { width: 400, height: 300 };

/** Run the case `frames`. */
export function benchFrameTime(bench: BenchContext): Promise<BenchFigures> {
  return withPage(bench, { viewport: VIEWPORT }, async ({ page, protocol }) => {
    await page.addInitScript(markDrawn);
    await page.goto(`${bench.url}/?quality=best`);
    await controlLimbs(page);
    await protocol.send("Emulation.setCPUThrottlingRate", { rate: CPU_SLOWDOWN });
    await waitForFrames(page, WARM_UP_FRAMES);
    const browser = page.context().browser();
    await browser?.startTracing(page, { categories: ["devtools.timeline", "blink.user_timing"] });
    await waitForFrames(page, MEASURED_FRAMES);
    const trace = JSON.parse((await browser?.stopTracing())?.toString() ?? "") as { traceEvents: TraceEvent[] };
    return computeFrameFigures(bench, trace.traceEvents);
  });
}

/** Compute the figures from a trace in which `markDrawn` marked the frames that drew. */
function computeFrameFigures(bench: BenchContext, events: TraceEvent[]): BenchFigures {
  const main = events.find(({ name }) => name === "FireAnimationFrame")?.tid;
  const mainEvents = events.filter(({ tid }) => tid === main);
  const marks = mainEvents.filter(({ name }) => name === "drawn").map(({ ts }) => ts);
  const fired = mainEvents.filter(
    ({ name, dur, tdur }) => name === "FireAnimationFrame" && dur !== undefined && tdur !== undefined,
  );
  const drew = fired.filter(({ ts, dur = 0 }) => marks.some((at) => at >= ts && at <= ts + dur));
  const work = drew.map(({ tdur = 0 }) => tdur / 1000);
  const wall = drew.map(({ dur = 0 }) => dur / 1000);
  bench.note(
    `frames: ${drew.length} of ${fired.length} drew; wall clock time ` +
      `p50 ${roundTo(percentile(wall, 50))} ms, p95 ${roundTo(percentile(wall, 95))} ms`,
  );
  return { frame_ms_p95: roundTo(percentile(work, 95)), frame_ms_p50: roundTo(percentile(work, 50)) };
}

/** Wait until `count` more frames have drawn. */
async function waitForFrames(page: Page, count: number): Promise<void> {
  const until = (await page.evaluate(() => window.drawn)) + count;
  await page.waitForFunction((until) => window.drawn >= until, until, { timeout: 240_000 });
}

/** Run the case `drawing`. */
export function benchDrawCalls(bench: BenchContext): Promise<BenchFigures> {
  return withPage(bench, { viewport: VIEWPORT }, async ({ page }) => {
    await page.goto(`${bench.url}/?quality=best`);
    await controlLimbs(page);
    const info = await page.evaluate(
      () =>
        new Promise<{ calls: number; triangles: number }>((resolve) => {
          const { renderer } = window.bunraku.stage;
          const { info } = renderer;
          const render = renderer.render;
          // With autoReset only the last pass is counted, without the shadows.
          info.autoReset = false;
          renderer.render = (scene, camera) => {
            info.reset();
            render.call(renderer, scene, camera);
            resolve({ calls: info.render.calls, triangles: info.render.triangles });
          };
        }),
    );
    return { draw_calls: info.calls, triangles: info.triangles };
  });
}

/** Claim three limbs and move them in every frame of the page. */
async function controlLimbs(page: Page): Promise<void> {
  await waitForFirstPose(page);
  await waitForWelcome(page);
  await page.evaluate((limbs) => {
    const { hands, stage } = window.bunraku;
    for (const limb of limbs) hands.claim(limb, "pointer");
    const draw = stage.draw.bind(stage);
    const at = stage.rig.group.position.clone();
    stage.draw = (...args) => {
      const phase = performance.now() / 700;
      for (const limb of limbs) {
        stage.puppet?.handle(limb, at);
        hands.pullTo(limb, at.set(at.x + 0.1 * Math.sin(phase + limb), at.y + 0.1 * Math.cos(phase), at.z));
      }
      draw(...args);
    };
  }, CONTROLLED_LIMBS);
  for (const limb of CONTROLLED_LIMBS) await waitForHold(page, limb);
}

/** In the page: add a performance mark to every frame that draws. */
function markDrawn(): void {
  window.drawn = 0;
  const request = window.requestAnimationFrame.bind(window);
  window.requestAnimationFrame = (callback) =>
    request((time) => {
      const { info } = window.bunraku?.stage?.renderer ?? {};
      const before = info?.render.frame;
      callback(time);
      if (info?.render.frame === before) return;
      window.drawn++;
      performance.mark("drawn");
      performance.clearMarks();
    });
}
