/** Draws a scene as a picture on a canvas of its own, so that what is on the page stays as it is. */
import { ACESFilmicToneMapping, PCFShadowMap, type PerspectiveCamera, type Scene, WebGLRenderer } from "three";
import { createEnvironmentMap } from "../scenery/environment-map";
import type { Look } from "../scenery/look";

/** Pixels that a picture is wide at least, and no side of it is longer than. */
const MIN_WIDTH_PX = 1600;
const MAX_SIDE_PX = 4096;

/** Pixels of a picture of a stage so many CSS pixels large: twice as sharp, or as wide as a picture is at least. */
export function pictureSize(width: number, height: number): { width: number; height: number } {
  const scale = Math.min(Math.max(2, MIN_WIDTH_PX / width), MAX_SIDE_PX / Math.max(width, height));
  return { width: Math.round(width * scale), height: Math.round(height * scale) };
}

export class PictureRenderer {
  #renderer: WebGLRenderer | null = null;

  /** `scene` as it is now through `camera`, as PNG of this size. Rejects where it cannot be drawn. */
  async render(
    scene: Scene,
    camera: PerspectiveCamera,
    look: Look,
    { width, height }: { width: number; height: number },
  ): Promise<Blob> {
    // one for all pictures: browsers give few, and take them back late
    if (!this.#renderer || this.#renderer.getContext().isContextLost())
      this.#renderer = new WebGLRenderer({ antialias: true });
    const renderer = this.#renderer;
    renderer.toneMapping = ACESFilmicToneMapping;
    renderer.toneMappingExposure = look.exposure;
    renderer.shadowMap.enabled = true;
    renderer.shadowMap.type = PCFShadowMap;
    renderer.setSize(width, height, false);
    const before = scene.environment;
    const environment = createEnvironmentMap(renderer, look);
    scene.environment = environment;
    try {
      renderer.render(scene, camera);
    } finally {
      scene.environment = before;
      environment.dispose();
    }
    // what was drawn is gone after this task, the copy that is made into a file stays
    const picture = new Promise<Blob | null>((done) => renderer.domElement.toBlob(done, "image/png"));
    renderer.setSize(1, 1, false);
    const made = await picture;
    if (!made) throw new Error("this browser makes no picture of the stage");
    return made;
  }

  /** Gives its graphics back; another picture takes new ones. */
  dispose(): void {
    this.#renderer?.dispose();
    this.#renderer?.forceContextLoss();
    this.#renderer = null;
  }
}
