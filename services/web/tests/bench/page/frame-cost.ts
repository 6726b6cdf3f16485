/** Cases `frames` and `drawing`: cost of a frame while three limbs are controlled. */
import type { Page } from "playwright-core";
import { engineOf, evaluateInEngine, installInRealms } from "../../browser/engine-probe";
import { waitForFirstPose, waitForHold, waitForWelcome } from "../../browser/page-probe";
import { type BenchContext, type BenchFigures, percentile, roundTo, withPage } from "./bench";
import {
  CALLBACK_EVENTS,
  DRAWN_MARK,
  FRAME_MARK,
  findDrawnFrames,
  sumMainThreadWork,
  TASK_CATEGORY,
  TASK_EVENTS,
  TRACE_CATEGORIES,
  type TraceEvent,
} from "./frame-trace";

declare global {
  /** In the engine's realm: number of frames that have drawn. */
  var drawnFrameCount: number;
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
    await installInRealms(page, markDrawnFrames, DRAWN_MARK);
    await page.goto(`${bench.url}/?quality=best`);
    await controlLimbs(page);
    const hasWorker = (await engineOf(page)) !== page;
    if (hasWorker) await page.evaluate(markFrames, FRAME_MARK);
    await protocol.send("Emulation.setCPUThrottlingRate", { rate: CPU_SLOWDOWN });
    await waitForDrawnFrames(page, WARM_UP_FRAMES);
    const browser = page.context().browser();
    await browser?.startTracing(page, {
      categories: hasWorker ? [...TRACE_CATEGORIES, TASK_CATEGORY] : TRACE_CATEGORIES,
    });
    await waitForDrawnFrames(page, MEASURED_FRAMES);
    const trace = JSON.parse((await browser?.stopTracing())?.toString() ?? "") as { traceEvents: TraceEvent[] };
    return hasWorker ? computeThreadFigures(bench, trace.traceEvents) : computePageFigures(bench, trace.traceEvents);
  });
}

/** Compute the figure of an engine in the page's realm. */
function computePageFigures(bench: BenchContext, events: TraceEvent[]): BenchFigures {
  const { work, wall, callbackCount } = findDrawnFrames(events);
  bench.note(
    `frames: ${work.length} of ${callbackCount} drew; ${describe("callback", work)}; ${describe("wall clock", wall)}`,
  );
  return { main_ms_p95: roundTo(percentile(work, 95)) };
}

/** Compute the figures of an engine in a worker, whose times are scaled: Chromium slows only the page's main thread. */
function computeThreadFigures(bench: BenchContext, events: TraceEvent[]): BenchFigures {
  const main = sumMainThreadWork(events, CALLBACK_EVENTS);
  const tasks = sumMainThreadWork(events, TASK_EVENTS);
  const { work, wall, callbackCount } = findDrawnFrames(events);
  const scaled = work.map((time) => time * CPU_SLOWDOWN);
  bench.note(`frames: ${main.length} of the page; ${describe("callbacks", main)}; ${describe("all tasks", tasks)}`);
  bench.note(
    `frames: ${work.length} of ${callbackCount} of the worker drew; ${describe("worker", scaled)}, which is ` +
      `${CPU_SLOWDOWN} times the measured time; ${describe("wall clock as measured", wall)}`,
  );
  return { main_ms_p95: roundTo(percentile(main, 95)), worker_ms_p95: roundTo(percentile(scaled, 95)) };
}

function describe(subject: string, times: readonly number[]): string {
  return `${subject} p50 ${roundTo(percentile(times, 50))} ms, p95 ${roundTo(percentile(times, 95))} ms`;
}

/** Wait until `count` more frames have drawn. */
function waitForDrawnFrames(page: Page, count: number): Promise<void> {
  // Waits in the engine, without a time limit: polling from here would disturb the measurement.
  return evaluateInEngine(
    page,
    (count) =>
      new Promise<void>((done) => {
        const until = globalThis.drawnFrameCount + count;
        const check = () => void (globalThis.drawnFrameCount >= until ? done() : requestAnimationFrame(check));
        check();
      }),
    count,
  );
}

/** Run the case `drawing`. */
export function benchDrawCalls(bench: BenchContext): Promise<BenchFigures> {
  return withPage(bench, { viewport: VIEWPORT }, async ({ page }) => {
    await page.goto(`${bench.url}/?quality=best`);
    await controlLimbs(page);
    const info = await evaluateInEngine(
      page,
      () =>
        new Promise<{ calls: number; triangles: number }>((resolve) => {
          const { renderer } = globalThis.bunraku.stage;
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
  await evaluateInEngine(
    page,
    (limbs) => {
      const { hands, stage } = globalThis.bunraku;
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
    },
    CONTROLLED_LIMBS,
  );
  for (const limb of CONTROLLED_LIMBS) await waitForHold(page, limb);
}

/** In a page and its workers: add a performance mark to every frame that draws. */
function markDrawnFrames(mark: string): void {
  globalThis.drawnFrameCount = 0;
  const request = globalThis.requestAnimationFrame.bind(globalThis);
  globalThis.requestAnimationFrame = (callback) =>
    request((time) => {
      const { info } = globalThis.bunraku?.stage?.renderer ?? {};
      const before = info?.render.frame;
      callback(time);
      if (info?.render.frame === before) return;
      globalThis.drawnFrameCount++;
      performance.mark(mark);
      performance.clearMarks();
    });
}

/** In the page: add a performance mark to every animation frame. */
function markFrames(mark: string): void {
  requestAnimationFrame(() => {
    performance.mark(mark);
    performance.clearMarks();
    markFrames(mark);
  });
}
