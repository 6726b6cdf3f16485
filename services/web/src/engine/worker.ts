/** The engine of a page in its worker, which `main.ts` starts. */
import { loadLanguage } from "../i18n/language";
import { createCanvas } from "../stage/rendering/canvas";
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

/** Run the engine of the page that has started this worker. */
export function serveEngine(): void {
  // The renderer loads while the page prepares the canvas; the engine reports it if it does not load.
  import("./stage-chunk").catch(() => undefined);
  /** Resolves with the engine once the first message has started it. */
  let engine: Promise<Engine> | null = null;
  self.addEventListener("message", ({ data }: MessageEvent<EngineStart | EngineCommand>) => {
    if (data.type === "start") engine = start(data);
    else void engine?.then((started) => started.handle(data));
  });
  // Only errors reach the page.
  self.addEventListener("unhandledrejection", (event) => {
    event.preventDefault();
    reportError(event.reason);
  });
  self.postMessage({ type: "hello", isSupported: hasGraphics() } satisfies EngineHello);
}

async function start({ canvas, options }: EngineStart): Promise<Engine> {
  await loadLanguage(options.language);
  const started = new Engine(canvas, options, (event) => self.postMessage(event));
  void started.start();
  return started;
}

function hasGraphics(): boolean {
  try {
    const context = createCanvas(1, 1).getContext("webgl2") as WebGL2RenderingContext | null;
    context?.getExtension("WEBGL_lose_context")?.loseContext();
    return context !== null && typeof requestAnimationFrame === "function";
  } catch {
    return false;
  }
}
