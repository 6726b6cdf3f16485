/**
 * A canvas's graphics, opened by themselves: that takes the browser a while, which on a slow line is spent while what draws is on
 * its way, and it waits for nothing that the page has painted before.
 */
import { AdaptiveQuality } from "./quality";

export interface Graphics {
  readonly context: WebGL2RenderingContext;
  /** How much is to be drawn with them. */
  readonly quality: AdaptiveQuality;
}

/** Opens the graphics of `canvas`; `pinned` keeps the best quality on any machine, for pictures. Throws where the browser has no WebGL 2. */
export function openGraphics(canvas: HTMLCanvasElement, pinQuality = false): Graphics {
  const quality = new AdaptiveQuality(rendererName(), pinQuality);
  const context = canvas.getContext("webgl2", {
    antialias: !quality.quality.simpleMaterials,
    powerPreference: "high-performance",
  });
  if (!context) throw new Error("this browser has no WebGL 2");
  return { context, quality };
}

/** What draws here, asked of a context of its own, since a canvas fixes its smoothing with its first one. */
function rendererName(): string {
  const context = document.createElement("canvas").getContext("webgl2");
  if (!context) throw new Error("this browser has no WebGL 2");
  const told = context.getExtension("WEBGL_debug_renderer_info");
  const name = told ? String(context.getParameter(told.UNMASKED_RENDERER_WEBGL)) : "";
  context.getExtension("WEBGL_lose_context")?.loseContext();
  return name;
}
