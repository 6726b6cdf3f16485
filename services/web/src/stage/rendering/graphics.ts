/**
 * Opens the graphics context of a canvas separately from the stage: it takes the browser some time, which on a slow
 * connection overlaps with the download of the stage, and it does not wait for what the page has painted before.
 */
import { createCanvas, type StageCanvas } from "./canvas";
import { AdaptiveQuality } from "./quality";

export interface Graphics {
  readonly context: WebGL2RenderingContext;
  /** Rendering quality in this context. */
  readonly quality: AdaptiveQuality;
}

/**
 * Open the context of `canvas`. `pinQuality` keeps the best quality on any machine, for screenshots. `driver` is the
 * name of the graphics driver, if it is known already. Throw if the browser has no WebGL 2.
 */
export function openGraphics(canvas: StageCanvas, pinQuality = false, driver = readDriverName()): Graphics {
  const quality = new AdaptiveQuality(driver ?? "", pinQuality);
  const context = canvas.getContext("webgl2", {
    antialias: !quality.quality.simpleMaterials,
    powerPreference: "high-performance",
  }) as WebGL2RenderingContext | null;
  if (!context) throw new Error("The browser does not support WebGL 2.");
  return { context, quality };
}

/**
 * Return the name of the graphics driver, empty if it is secret; null without WebGL 2. It is read from a separate
 * context: a canvas fixes its antialiasing with its first context.
 */
export function readDriverName(): string | null {
  const context = createCanvas(1, 1).getContext("webgl2") as WebGL2RenderingContext | null;
  if (!context) return null;
  const debugInfo = context.getExtension("WEBGL_debug_renderer_info");
  const name = debugInfo ? String(context.getParameter(debugInfo.UNMASKED_RENDERER_WEBGL)) : "";
  context.getExtension("WEBGL_lose_context")?.loseContext();
  return name;
}
