/** Renderer of an immersive session, which draws on a canvas of its own that is in no document. */
import {
  ACESFilmicToneMapping,
  type Camera,
  PCFShadowMap,
  type PerspectiveCamera,
  type Scene,
  WebGLRenderer,
} from "three";
import { createCanvas } from "../stage/rendering/canvas";
import { completeRenderer } from "./complete-renderer";

completeRenderer();

/** Create the renderer. Throw if the browser has no WebGL 2. */
export function createImmersiveRenderer(antialias: boolean): WebGLRenderer {
  const canvas = createCanvas(1, 1) as HTMLCanvasElement;
  const context = canvas.getContext("webgl2", {
    antialias,
    // On a machine with several graphics processors the one that the headset is at.
    xrCompatible: true,
    powerPreference: "high-performance",
  });
  if (!context) throw new Error("The browser does not support WebGL 2.");
  const renderer = new WebGLRenderer({ canvas, context });
  renderer.toneMapping = ACESFilmicToneMapping;
  renderer.shadowMap.enabled = true;
  renderer.shadowMap.type = PCFShadowMap;
  renderer.xr.enabled = true;
  renderer.xr.setReferenceSpaceType("local-floor");
  // The cameras are updated by `drawFrame`.
  renderer.xr.cameraAutoUpdate = false;
  return renderer;
}

/**
 * Draw a frame to the headset. `camera` is in the frame of the room, which may be larger than the scene's: a viewer of
 * a small stage is a giant in it. World matrices are up to date.
 */
export function drawFrame(renderer: WebGLRenderer, scene: Scene, camera: PerspectiveCamera): void {
  const { xr } = renderer;
  xr.updateCamera(camera);
  const eyes = xr.getCamera();
  for (const eye of [eyes, ...eyes.cameras]) removeScale(eye);
  renderer.render(scene, camera);
}

/** Make the view of a camera rigid: lights and billboards measure in the scene's metres. */
function removeScale(camera: Camera): void {
  const { elements } = camera.matrixWorld;
  const scale = Math.hypot(elements[0], elements[1], elements[2]);
  for (const column of [0, 4, 8]) for (let row = 0; row < 3; row++) elements[column + row] /= scale;
  camera.matrixWorldInverse.copy(camera.matrixWorld).invert();
}
