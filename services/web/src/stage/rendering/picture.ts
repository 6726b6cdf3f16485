/** Renders a scene to an image on a separate canvas, so that the page's canvas is unchanged. */
import { ACESFilmicToneMapping, PCFShadowMap, type PerspectiveCamera, type Scene, WebGLRenderer } from "three";
import { createEnvironmentMap } from "../scenery/environment-map";
import type { Look } from "../scenery/look";
import { createCanvas, encodePng } from "./canvas";

/** Minimum width and maximum side of an image, in pixels. */
const MIN_WIDTH_PX = 1600;
const MAX_SIDE_PX = 4096;

/** Return the size of the image of a stage of so many CSS pixels: twice its resolution, or the minimum width. */
export function pictureSize(width: number, height: number): { width: number; height: number } {
  const scale = Math.min(Math.max(2, MIN_WIDTH_PX / width), MAX_SIDE_PX / Math.max(width, height));
  return { width: Math.round(width * scale), height: Math.round(height * scale) };
}

export class PictureRenderer {
  #renderer: WebGLRenderer | null = null;

  /**
   * Render `scene` through `camera` to a PNG for a stage of so many CSS pixels. Reject if it cannot be drawn.
   */
  async render(
    scene: Scene,
    camera: PerspectiveCamera,
    look: Look,
    stageWidth: number,
    stageHeight: number,
  ): Promise<Blob> {
    const { width, height } = pictureSize(stageWidth, stageHeight);
    // One renderer for all images: browsers allow few contexts, and release them late.
    if (!this.#renderer || this.#renderer.getContext().isContextLost())
      this.#renderer = new WebGLRenderer({ canvas: createCanvas(1, 1), antialias: true });
    const renderer = this.#renderer;
    renderer.toneMapping = ACESFilmicToneMapping;
    renderer.toneMappingExposure = look.exposure;
    renderer.shadowMap.enabled = true;
    renderer.shadowMap.type = PCFShadowMap;
    renderer.setSize(width, height, false);
    const previousEnvironment = scene.environment;
    const environment = createEnvironmentMap(renderer, look);
    scene.environment = environment;
    try {
      renderer.render(scene, camera);
    } finally {
      scene.environment = previousEnvironment;
      environment.dispose();
    }
    // The drawing buffer is cleared after this task, but the encoder has copied it by then.
    const picture = encodePng(renderer.domElement);
    renderer.setSize(1, 1, false);
    const png = await picture;
    if (!png) throw new Error("The browser could not encode the picture of the stage as PNG.");
    return png;
  }

  /** Release the context; the next image opens a new one. */
  dispose(): void {
    this.#renderer?.dispose();
    this.#renderer?.forceContextLoss();
    this.#renderer = null;
  }
}
