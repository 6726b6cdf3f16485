/** The engine of a page in its worker, which `main.ts` starts. */
import { loadLanguage } from "../i18n/language";
import { readDriverName } from "../stage/rendering/graphics";
import { Engine } from "./engine";
import type { EngineCommand, EngineOptions } from "./message";

/** First message to the worker. */
export interface EngineStart {
  readonly type: "start";
  readonly canvas: OffscreenCanvas;
  readonly options: EngineOptions;
}

/** First message of the worker: whether it can draw. */
export interface EngineHello {
  readonly type: "hello";
  readonly isSupported: boolean;
}

/**
 * Run the engine of the page that has started this worker. Where it cannot draw, close the worker after `loads`:
 * Firefox reports modules whose evaluation the end of a worker interrupts as errors of the page.
 */
export function serveEngine(loads: Promise<unknown>): void {
  const driver = findDriver();
  /** Resolves with the engine once the first message has started it. */
  let engine: Promise<Engine> | null = null;
  self.addEventListener("message", ({ data }: MessageEvent<EngineStart | EngineCommand>) => {
    if (data.type === "start") engine = start(data, driver ?? undefined);
    else void engine?.then((started) => started.handle(data));
  });
  // Only errors reach the page.
  self.addEventListener("unhandledrejection", (event) => {
    event.preventDefault();
    reportError(event.reason);
  });
  self.postMessage({ type: "hello", isSupported: driver !== null } satisfies EngineHello);
  if (driver === null) void loads.then(() => self.close());
}

async function start({ canvas, options }: EngineStart, driver?: string): Promise<Engine> {
  await loadLanguage(options.language);
  const started = new Engine(canvas, options, (event) => self.postMessage(event), driver);
  void started.start();
  return started;
}

/** Return the name of the graphics driver; null if a worker cannot draw. */
function findDriver(): string | null {
  try {
    return typeof requestAnimationFrame === "function" ? readDriverName() : null;
  } catch {
    return null;
  }
}
