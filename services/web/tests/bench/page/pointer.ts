/** Case `pointer`: time from a movement of the mouse that drags a hand to the end of the frame that shows it. */
import { setTimeout as delay } from "node:timers/promises";
import type { CDPSession, Page } from "playwright-core";
import { evaluateInEngine, waitInEngine } from "../../browser/engine-probe";
import {
  LEFT_HAND,
  pauseAtStart,
  ringPosition,
  waitForFirstPose,
  waitForHold,
  waitForWelcome,
  waitUntilSettled,
} from "../../browser/page-probe";
import { type BenchContext, type BenchFigures, percentile, roundTo, withPage } from "./bench";

interface Point {
  x: number;
  y: number;
}

/** Times are in milliseconds since the epoch: the clocks of page and engine begin at different times. */
interface TimedPoint extends Point {
  time: number;
}

declare global {
  /** In the page's realm: every movement of the pointer, also those that the browser has combined. */
  var pointerMoves: TimedPoint[];
  /** In the engine's realm: the last point to which the pointer pulled before the end of each drawn frame. */
  var shownPoints: TimedPoint[];
}

const VIEWPORT = { width: 400, height: 300 };
/** Interval of the movements: mice report at 125 Hz. */
const MOVE_INTERVAL_MS = 8;
/** Every point of a square of this side is visited once, so that a frame tells which movement it shows. */
const SQUARE_PX = 20;

/** Run the case `pointer`. */
export function benchPointer(bench: BenchContext): Promise<BenchFigures> {
  return withPage(bench, { viewport: VIEWPORT }, async ({ page, protocol }) => {
    await page.goto(bench.url);
    await waitForFirstPose(page);
    await waitForWelcome(page);
    await pauseAtStart(page);
    const ring = await waitUntilSettled(page, () => ringPosition(page, LEFT_HAND), 0.5);
    const start = { x: Math.round(ring.x), y: Math.round(ring.y) };
    await page.mouse.move(start.x, start.y);
    await evaluateInEngine(page, recordShownPoints);
    await page.mouse.down();
    await waitForHold(page, LEFT_HAND);
    // The motion plays meanwhile, so that every frame differs and is drawn.
    await page.keyboard.press("Space");
    await page.getByRole("button", { name: "Pause" }).waitFor();
    await page.evaluate(recordMoves);
    const end = await moveOverSquare(protocol, start);
    const moves = await page.evaluate(() => globalThis.pointerMoves);
    const shown = await waitForPoint(page, end, start);
    await page.mouse.up();
    const latencies = computeLatencies(moves, shown);
    bench.note(
      `pointer: ${latencies.length} movements, p50 ${roundTo(percentile(latencies, 50))} ms; ` +
        `frame interval p50 ${roundTo(percentile(intervals(shown), 50))} ms`,
    );
    return { pointer_ms_p95: roundTo(percentile(latencies, 95)) };
  });
}

/** Move the mouse over a square above `start`, line by line, and return its last position. */
async function moveOverSquare(protocol: CDPSession, start: Point): Promise<Point> {
  const sent: Promise<unknown>[] = [];
  let at = start;
  for (let nth = 0; nth < SQUARE_PX ** 2; nth++) {
    const row = Math.floor(nth / SQUARE_PX);
    const column = nth % SQUARE_PX;
    at = { x: start.x + (row % 2 === 0 ? column : SQUARE_PX - 1 - column), y: start.y - 1 - row };
    // Not awaited: the answer comes only after the page has handled the movement.
    sent.push(protocol.send("Input.dispatchMouseEvent", { type: "mouseMoved", ...at, button: "left", buttons: 1 }));
    await delay(MOVE_INTERVAL_MS);
  }
  await Promise.all(sent);
  return at;
}

/** Wait until a frame shows a point, and return the shown points in coordinates of the pointer. */
async function waitForPoint(page: Page, point: Point, start: Point): Promise<TimedPoint[]> {
  // The hand keeps its offset from the pointer: the first point is that of the grab.
  const [first] = await evaluateInEngine(page, () => globalThis.shownPoints);
  const [dx, dy] = [first.x - start.x, first.y - start.y];
  await waitInEngine(
    page,
    ({ x, y }) => {
      const last = globalThis.shownPoints.at(-1)!;
      return Math.hypot(last.x - x, last.y - y) < 0.5;
    },
    { x: point.x + dx, y: point.y + dy },
  );
  const shown = await evaluateInEngine(page, () => globalThis.shownPoints);
  return shown.map(({ x, y, time }) => ({ x: Math.round(x - dx), y: Math.round(y - dy), time }));
}

/** Return the time in milliseconds from each movement to the end of the first frame that shows it or a later one. */
function computeLatencies(moves: readonly TimedPoint[], shown: readonly TimedPoint[]): number[] {
  const order = new Map(moves.map(({ x, y }, nth) => [`${x} ${y}`, nth]));
  const frames = shown.map(({ x, y, time }) => ({ nth: order.get(`${x} ${y}`) ?? -1, time }));
  return moves.map((move, nth) => {
    const frame = frames.find((frame) => frame.nth >= nth);
    if (!frame) throw new Error(`No frame shows the movement to ${move.x}, ${move.y}`);
    return frame.time - move.time;
  });
}

function intervals(frames: readonly TimedPoint[]): number[] {
  return frames.slice(1).map(({ time }, nth) => time - frames[nth].time);
}

/** In the page: record the movements of the pointer. */
function recordMoves(): void {
  globalThis.pointerMoves = [];
  const record = (event: PointerEvent) => {
    for (const { clientX, clientY, timeStamp } of event.getCoalescedEvents())
      globalThis.pointerMoves.push({ x: clientX, y: clientY, time: performance.timeOrigin + timeStamp });
  };
  addEventListener("pointermove", record, { capture: true });
}

/** In the engine: record to which point on the screen the pointer pulls a limb when a frame has been drawn. */
function recordShownPoints(): void {
  const { stage } = globalThis.bunraku;
  globalThis.shownPoints = [];
  let pulled: Point | null = null;
  let isDrawing = false;
  const fromScreen = stage.fromScreen.bind(stage);
  stage.fromScreen = (x, y, through) => {
    // While it draws, the stage asks for other points.
    if (!isDrawing) pulled = { x, y };
    return fromScreen(x, y, through);
  };
  const draw = stage.draw.bind(stage);
  stage.draw = (...state) => {
    const { frame } = stage.renderer.info.render;
    isDrawing = true;
    draw(...state);
    isDrawing = false;
    if (pulled && stage.renderer.info.render.frame !== frame)
      globalThis.shownPoints.push({ ...pulled, time: performance.timeOrigin + performance.now() });
  };
}
