/** Draws frames on the stage's canvas, one at a time and in a quality that the machine can keep up with. */
import { ACESFilmicToneMapping, PCFShadowMap, type PerspectiveCamera, type Scene, Vector2, WebGLRenderer } from "three";
import type { Look } from "../scenery/look";
import { FrameFence } from "./frame-fence";
import type { Graphics } from "./graphics";
import { PictureRenderer, pictureSize } from "./picture";
import type { AdaptiveQuality, Quality } from "./quality";

export class FrameRenderer {
  readonly renderer: WebGLRenderer;
  readonly #quality: AdaptiveQuality;
  readonly #fence: FrameFence;
  readonly #pictures = new PictureRenderer();
  #width = 1;
  #height = 1;
  #pixelRatio = 1;
  #sinceDrawnS = 0;
  #isTakingPicture = false;

  constructor(canvas: HTMLCanvasElement, { context, quality }: Graphics) {
    this.#quality = quality;
    this.#fence = new FrameFence(context);
    this.renderer = new WebGLRenderer({ canvas, context });
    this.renderer.toneMapping = ACESFilmicToneMapping;
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
  }

  get quality(): Quality {
    return this.#quality.quality;
  }

  /** Set the size of the canvas in CSS pixels. It takes effect with the next frame. */
  resize(width: number, height: number, pixelRatio: number): void {
    this.#width = width;
    this.#height = height;
    this.#pixelRatio = pixelRatio;
  }

  /** Add the seconds since the last call. Return whether the last frame is complete and another can be drawn. */
  advance(seconds: number): boolean {
    this.#sinceDrawnS += seconds;
    return this.#fence.isReady;
  }

  /** Draw a frame. Return whether the quality has changed; only a measured frame can change it. */
  draw(scene: Scene, camera: PerspectiveCamera, isMeasured: boolean): boolean {
    this.#applySize();
    this.renderer.render(scene, camera);
    this.#fence.insert();
    const hasChanged = isMeasured && !this.#isTakingPicture && this.#quality.addFrameTime(this.#sinceDrawnS);
    this.#sinceDrawnS = 0;
    return hasChanged;
  }

  /** Render the scene to a PNG in a resolution of at least twice the canvas. */
  takePicture(scene: Scene, camera: PerspectiveCamera, look: Look): Promise<Blob> {
    this.#isTakingPicture = true;
    return this.#pictures.render(scene, camera, look, pictureSize(this.#width, this.#height)).finally(() => {
      this.#isTakingPicture = false;
      this.#quality.restart();
    });
  }

  /** Start anew after the context was lost and restored. */
  reset(): void {
    this.#fence.reset();
    this.#quality.restart();
    this.#sinceDrawnS = 0;
  }

  dispose(): void {
    this.#pictures.dispose();
    this.renderer.dispose();
    // Frees the context's memory at once: browsers keep few contexts and would take one from another stage.
    this.renderer.forceContextLoss();
  }

  /** Resize the canvas right before drawing, since resizing clears it, and only if the size has changed. */
  #applySize(): void {
    const ratio = this.#pixelRatio * this.quality.pixelRatioScale;
    const size = this.renderer.getSize(new Vector2());
    if (ratio === this.renderer.getPixelRatio() && size.x === this.#width && size.y === this.#height) return;
    // Both at once: each size change of a canvas waits for the graphics processor.
    this.renderer.setDrawingBufferSize(this.#width, this.#height, ratio);
  }
}
