/** Draws frames on the stage's canvas, one at a time and in a quality that the machine can keep up with. */
import { ACESFilmicToneMapping, PCFShadowMap, type PerspectiveCamera, type Scene, Vector2, WebGLRenderer } from "three";
import type { ScreenBox } from "../camera/screen-box";
import type { Look } from "../scenery/look";
import type { StageCanvas } from "./canvas";
import type { EdgeSmoothing } from "./edge-smoothing";
import { FrameFence } from "./frame-fence";
import type { Graphics } from "./graphics";
import type { PictureRenderer } from "./picture";
import type { AdaptiveQuality, Quality } from "./quality";
import { SceneWatcher } from "./scene-watcher";

/** A stage that does not change for this time is drawn once more in the best quality, in seconds. */
const STILL_S = 0.15;
/** Callbacks over which the interval of the display is the shortest. */
const DISPLAY_CALLBACKS = 30;

export class FrameRenderer {
  readonly renderer: WebGLRenderer;
  readonly #quality: AdaptiveQuality;
  readonly #fence: FrameFence;
  readonly #watcher = new SceneWatcher();
  /** Null until the first picture is taken. */
  #pictures: PictureRenderer | null = null;
  /** Null if the context has antialiasing, and until it is loaded. */
  #smoothing: EdgeSmoothing | null = null;
  #needsSmoothing: boolean;
  #width = 1;
  #height = 1;
  #pixelRatio = 1;
  #sinceDrawnS = 0;
  #stillS = 0;
  /** Quality of the last frame, null if the canvas does not show one. */
  #drawnQuality: Quality | null = null;
  readonly #intervals: number[] = [];
  #isTakingPicture = false;

  constructor(canvas: StageCanvas, { context, quality }: Graphics) {
    this.#quality = quality;
    this.#fence = new FrameFence(context);
    this.#needsSmoothing = !context.getContextAttributes()?.antialias;
    this.renderer = new WebGLRenderer({ canvas, context });
    this.renderer.toneMapping = ACESFilmicToneMapping;
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
  }

  /** Quality of the next frame: the best once the stage stands still. */
  get quality(): Quality {
    return this.#stillS >= STILL_S ? this.#quality.bestQuality : this.#quality.quality;
  }

  /** True if the last frame is complete and another can be drawn. */
  get isReady(): boolean {
    return this.#fence.isReady;
  }

  /** True if the last frame is incomplete and another can be drawn soon. */
  get isPending(): boolean {
    return this.#fence.isPending;
  }

  /** Set the size of the canvas in CSS pixels. It takes effect with the next frame. */
  resize(width: number, height: number, pixelRatio: number): void {
    this.#width = width;
    this.#height = height;
    this.#pixelRatio = pixelRatio;
  }

  /** Draw the next frame, even if nothing seems to have moved. */
  invalidate(): void {
    this.#drawnQuality = null;
  }

  /**
   * Advance by `seconds`, the time since the last call, to the present state of the scene; `further` are numbers that
   * affect the picture beside it. Return whether it differs from what the canvas shows.
   */
  advance(seconds: number, scene: Scene, camera: PerspectiveCamera, further: readonly number[]): boolean {
    if (seconds > 0) this.#intervals.push(seconds);
    if (this.#intervals.length > DISPLAY_CALLBACKS) this.#intervals.shift();
    const size = [this.#width, this.#height, this.#pixelRatio];
    const hasChanged = this.#watcher.hasChanged(scene, camera, [...size, ...further]);
    this.#stillS = hasChanged ? 0 : this.#stillS + seconds;
    const isOutdated = hasChanged || this.#drawnQuality !== this.quality;
    this.#sinceDrawnS = isOutdated ? this.#sinceDrawnS + seconds : 0;
    return isOutdated;
  }

  /**
   * Draw a frame. `edges` are boxes that all edges are in, in CSS pixels; null if there are none. Only the times of
   * frames with edges, in the same quality one after the other, are measured.
   */
  draw(scene: Scene, camera: PerspectiveCamera, edges: readonly ScreenBox[] | null): void {
    const { quality } = this;
    this.#applySize();
    this.renderer.render(scene, camera);
    if (edges && this.#needsSmoothing) this.#loadSmoothing();
    if (edges)
      this.#smoothing?.apply(
        this.renderer,
        edges.map((box) => this.#toShares(box)),
      );
    this.#fence.insert();
    this.#watcher.markDrawn();
    const isContinued = this.#drawnQuality === quality && quality === this.#quality.quality;
    if (edges && isContinued && !this.#isTakingPicture)
      this.#quality.addFrameTime(this.#sinceDrawnS, Math.min(...this.#intervals));
    this.#drawnQuality = quality;
    this.#sinceDrawnS = 0;
  }

  /** Load what takes pictures. */
  async loadPictures(): Promise<PictureRenderer> {
    if (!this.#pictures) {
      const { PictureRenderer } = await import("./picture");
      this.#pictures ??= new PictureRenderer();
    }
    return this.#pictures;
  }

  /** Render the scene to a PNG in a resolution of at least twice the canvas. */
  takePicture(pictures: PictureRenderer, scene: Scene, camera: PerspectiveCamera, look: Look): Promise<Blob> {
    this.#isTakingPicture = true;
    return pictures.render(scene, camera, look, this.#width, this.#height).finally(() => {
      this.#isTakingPicture = false;
      this.#quality.restart();
    });
  }

  /** Start anew after the context was lost and restored. */
  reset(): void {
    this.#fence.reset();
    this.#quality.restart();
    this.invalidate();
    this.#sinceDrawnS = 0;
  }

  dispose(): void {
    this.#pictures?.dispose();
    this.#smoothing?.dispose();
    this.renderer.dispose();
    // Frees the context's memory at once: browsers keep few contexts and would take one from another stage.
    this.renderer.forceContextLoss();
  }

  /** Load the smoothing of edges with the first frame, which has none. */
  #loadSmoothing(): void {
    this.#needsSmoothing = false;
    // Without it, edges are rough.
    void import("./edge-smoothing").then(
      ({ EdgeSmoothing }) => {
        this.#smoothing = new EdgeSmoothing();
        this.invalidate();
      },
      () => {},
    );
  }

  #toShares({ left, top, right, bottom }: ScreenBox): ScreenBox {
    return {
      left: left / this.#width,
      top: top / this.#height,
      right: right / this.#width,
      bottom: bottom / this.#height,
    };
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
