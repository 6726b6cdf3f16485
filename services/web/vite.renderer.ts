/** three.js's renderer without features that the page never uses, or only after a click. */
import { readFile } from "node:fs/promises";
import type { Plugin } from "vite";

/** Code of the modules without their features, by path in the folder of the sources. */
export const REPLACED_MODULES: Readonly<Record<string, string>> = {
  // Until `completeRenderer` is called, renderers present no immersive session: `isPresenting` never becomes true.
  "renderers/webxr/WebXRManager.js": `
    let Complete = null;
    export function completeWith(Manager) { Complete = Manager; }
    export class WebXRManager {
      constructor(renderer, gl) { if (Complete) return new Complete(renderer, gl); }
      enabled = false;
      isPresenting = false;
      addEventListener() {}
      removeEventListener() {}
      setAnimationLoop() {}
      getEnvironmentBlendMode() {}
      dispose() {}
    }`,
  // Only the cameras of such a session are arrays. It culls nothing.
  "math/FrustumArray.js": `
    export class FrustumArray {
      setFromArrayCamera() { return this; }
      intersectsObject() { return true; }
      intersectsSprite() { return true; }
    }`,
  // No material has groups of uniforms.
  "renderers/webgl/WebGLUniformsGroups.js": "export function WebGLUniformsGroups() { this.dispose = () => {}; }",
  // The canvas has 8 bits per channel, so the renderer creates no output pass.
  "renderers/webgl/WebGLOutput.js": "export class WebGLOutput {}",
};

const MODULE = /\/three\/src\/((?:math|renderers\/web(?:gl|xr))\/\w+\.js)$/;

/** The WebXR manager of three.js, and the module of the page that installs it. */
const MANAGER = "three/src/renderers/webxr/WebXRManager.js";
const COMPLETE = /\/WebXRManager\.js\?complete$/;
const INSTALLER = /\/src\/immersive\/complete-renderer\.ts$/;

/**
 * Methods that the page never calls: three.js's own file format, picking, which the page does by the positions of the
 * handles, tangents, and the renderer's copies of textures and pixels.
 */
const UNUSED_METHOD = /^\t(?:toJSON|fromJSON|raycast|computeTangents)\([^)]*\) \{\n.*?^\t\}\n/gms;
const UNUSED_RENDERER_METHOD =
  /^\t\tthis\.(?:readRenderTargetPixels(?:Async)?|copyTextureToTexture) = (?:async )?function \([^)]*\) \{\n.*?^\t\t\};\n/gms;

/** Remove the unused methods of the classes in a module of three.js. */
export function removeUnusedMethods(code: string): string {
  return code.replace(UNUSED_METHOD, "").replace(UNUSED_RENDERER_METHOD, "");
}

/** Replaces `REPLACED_MODULES`, and removes unused methods. */
export const reducedRenderer: Plugin = {
  name: "reduced-renderer",
  apply: "build",
  load: {
    filter: { id: [MODULE, COMPLETE, INSTALLER] },
    handler: (id) => {
      if (COMPLETE.test(id)) return readFile(id.replace(/\?.*$/, ""), "utf8");
      if (INSTALLER.test(id))
        return `import { completeWith } from "${MANAGER}"; import { WebXRManager } from "${MANAGER}?complete";
          export const completeRenderer = () => completeWith(WebXRManager);`;
      return REPLACED_MODULES[MODULE.exec(id)?.[1] ?? ""];
    },
  },
  transform: {
    filter: { id: /\/three\/src\/.*\.js$/, code: /\b(?:toJSON|fromJSON|raycast)\(|copyTextureToTexture = / },
    handler: removeUnusedMethods,
  },
};
