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
 * handles, and what custom scenes, cameras and curves would use. The page's scripts contain none of these names.
 */
const UNUSED_METHODS = `
  toJSON fromJSON raycast
  addColors addScalar clampScalar manhattanDistanceTo multiplyVectors randomDirection rotateAround roundToZero
  setFromColor setFromCylindrical setFromCylindricalCoords setFromMatrixScale setFromMatrix3Column setFromSpherical
  setFromSphericalCoords subScalar transformUv
  multiplyQuaternionsFlat rotateTowards setFromVector3 setAxisAngleFromQuaternion setAxisAngleFromRotationMatrix
  slerpQuaternions
  extractBasis makeRotationAxis makeRotationX makeShear setFromMatrix3 transposeIntoArray
  getHex getHexString getHSL getStyle lerpHSL offsetHSL
  containsBox containsPoint expandByScalar intersectsBox intersectsTriangle intersectTriangle setFromCenterAndSize
  setFromObject
  closestPointToPoint distanceToSphere getArea getBoundingBox getBoundingSphere getMidpoint getPlane intersectBox
  intersectLine intersectsLine intersectSphere projectPoint recast setFromAttributeAndIndices setFromCoplanarPoints
  setFromPointsAndIndices
  computeTangents computeVertexNormals getIndirect normalizeNormals setIndirect addLayerUpdate addUpdateRange copyAt
  computeFrenetFrames getPoints getSpacedPoints updateArcLengths
  getObjectById rotateOnWorldAxis rotateX setRotationFromAxisAngle setRotationFromEuler setRotationFromMatrix
  setRotationFromQuaternion translateY translateZ
  clearViewOffset getEffectiveFOV getFilmHeight getFocalLength getViewBounds getViewSize setFocalLength
  getColorAt getMorphAt setColorAt setMorphAt _computeIntersections
  compileCubemapShader compileEquirectangularShader _compileMaterial`
  .trim()
  .split(/\s+/);
/** Copies of textures and pixels that the page never makes. */
const UNUSED_RENDERER_METHODS = ["readRenderTargetPixels", "readRenderTargetPixelsAsync", "copyTextureToTexture"];

/** Names of which the page's scripts contain none. */
export const UNUSED_NAMES: readonly string[] = [...UNUSED_METHODS, ...UNUSED_RENDERER_METHODS];

const UNUSED_METHOD = new RegExp(
  `^\\t(?:static )?(?:${UNUSED_METHODS.join("|")})\\([^)]*\\) \\{(?:\\n.*?^\\t)?\\}\\n`,
  "gms",
);
const UNUSED_RENDERER_METHOD = new RegExp(
  `^\\t\\tthis\\.(?:${UNUSED_RENDERER_METHODS.join("|")}) = (?:async )?function \\([^)]*\\) \\{\\n.*?^\\t\\t\\};\\n`,
  "gms",
);
/** Table of the CSS names of colours; the page's colours are numbers. */
const COLOUR_NAMES = /^const _colorKeywords = \{.*?\};$/ms;

/** Remove the unused methods of the classes in a module of three.js, and the names of colours. */
export function removeUnusedMethods(code: string): string {
  return code
    .replace(UNUSED_METHOD, "")
    .replace(UNUSED_RENDERER_METHOD, "")
    .replace(COLOUR_NAMES, "const _colorKeywords = {};");
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
    filter: { id: /\/three\/src\/.*\.js$/ },
    handler: removeUnusedMethods,
  },
};
