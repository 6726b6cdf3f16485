/**
 * Completes three.js's renderer for immersive sessions. The build of the page leaves its WebXR manager out of the
 * stage's renderer and puts it here (`vite.renderer.ts`); other builds leave nothing out.
 */

/** Let renderers that are created from now on present immersive sessions. Call it once, before the first. */
export function completeRenderer(): void {
  // Nothing is left out.
}
