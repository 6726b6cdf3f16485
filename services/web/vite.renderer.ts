/** three.js's renderer without features that the page never uses. */
import type { Plugin } from "vite";

/** Code of the modules without their features, by path in the folder of the sources. */
export const REPLACED_MODULES: Readonly<Record<string, string>> = {
  // The page presents no immersive session, so `isPresenting` never becomes true.
  "renderers/webxr/WebXRManager.js": `
    export class WebXRManager {
      enabled = false;
      isPresenting = false;
      addEventListener() {}
      removeEventListener() {}
      setAnimationLoop() {}
      getEnvironmentBlendMode() {}
      dispose() {}
    }`,
  // Only the cameras of such a session are arrays.
  "math/FrustumArray.js": "export class FrustumArray {}",
  // No material has groups of uniforms.
  "renderers/webgl/WebGLUniformsGroups.js": "export function WebGLUniformsGroups() { this.dispose = () => {}; }",
  // The canvas has 8 bits per channel, so the renderer creates no output pass.
  "renderers/webgl/WebGLOutput.js": "export class WebGLOutput {}",
};

const MODULE = /\/three\/src\/((?:math|renderers\/web(?:gl|xr))\/\w+\.js)$/;

/** Replaces `REPLACED_MODULES`. */
export const reducedRenderer: Plugin = {
  name: "reduced-renderer",
  apply: "build",
  load: {
    filter: { id: MODULE },
    handler: (id) => REPLACED_MODULES[MODULE.exec(id)?.[1] ?? ""],
  },
};
