/** Rendering of an embedded stage, in the size of its element and while the element is visible. */
import type { ClaimController } from "../engine/claim-controller";
import { FrameLoop } from "../engine/frame-loop";
import type { Playback } from "../engine/playback";
import type { StageController } from "../engine/stage-controller";
import { createPageActions, type PageActions } from "../input/command-dispatcher";
import { listenToKeyboard } from "../input/keyboard";
import type { Mapping } from "../input/mapping";
import { loadMapping } from "../input/mapping-store";
import { listenToMouse } from "../input/mouse";
import type { PointerInput } from "../input/pointer";
import { listenToPointer, showPointerState } from "../input/pointer-events";
import type { Theme } from "../stage/scenery/look";
import type { ElementView } from "./view";

/** Pictures narrower than this ratio of width to height are framed as on a phone. */
const PORTRAIT_MAX_ASPECT_RATIO = 0.7;
/** In pictures lower than this the bar stands at the side (`element.css`). */
const SIDE_BAR_MAX_HEIGHT_PX = 380;

/** Key actions that the element supports, other than claiming and moving limbs. */
export type ElementKeyActions = Pick<
  PageActions,
  "next_dancer" | "ask" | "give" | "join" | "play" | "back" | "forward" | "sound"
>;

export class ElementRenderer {
  stageController: StageController | null = null;
  /** Limb whose button has the focus. */
  focusedLimb: number | null = null;
  /** Called when the first pose of a playback was drawn. */
  onFirstPose: () => void = () => undefined;
  readonly mapping: Mapping = loadMapping();
  #playback: Playback | null = null;
  #theme: Theme = "night";
  #still = false;
  #controls = false;
  #isVisible = true;
  #firstPoseReported = false;
  #closed = false;
  #frameLoop: FrameLoop | null = null;
  readonly #observers: { disconnect(): void }[] = [];

  constructor(
    private readonly view: ElementView,
    private readonly limbController: ClaimController,
  ) {}

  set theme(theme: Theme) {
    this.#theme = theme;
    this.stageController?.stage.setTheme(theme);
  }

  set still(still: boolean) {
    this.#still = still;
    if (this.stageController) this.stageController.stage.reducedMotion = still;
  }

  get still(): boolean {
    return this.#still;
  }

  /** True if the element has controls: the picture then leaves space for the bar, and keys are handled. */
  set controls(controls: boolean) {
    this.#controls = controls;
    this.#resize();
  }

  /** Draw another playback; null leaves the last picture. */
  setPlayback(playback: Playback | null): void {
    this.#playback = playback;
    this.#firstPoseReported = false;
    this.stageController?.setPlayback(playback);
  }

  /** Load the renderer and start drawing. Returns the reason if that is not possible. */
  async start(keyActions: ElementKeyActions): Promise<"not loaded" | "no graphics" | null> {
    const chunk = await import("../engine/stage-chunk").catch(() => null);
    if (this.#closed) return null;
    if (!chunk) return "not loaded";
    const { canvas, frame } = this.view;
    const ignore = () => undefined;
    const camera = () =>
      this.stageController?.stage.followMotionCamera(!this.stageController.stage.followsMotionCamera);
    const actions: PageActions = { ...createPageActions(ignore), camera, ...keyActions };
    try {
      this.stageController = new chunk.StageController(canvas, this.limbController, {
        getMapping: () => this.mapping,
        actions,
        onClaimsChange: () => this.limbController.render(),
      });
    } catch {
      return "no graphics";
    }
    const { stage, commands, pointer, velocity } = this.stageController;
    stage.reducedMotion = this.#still;
    stage.setTheme(this.#theme);
    const getMapping = () => (this.#controls ? this.mapping : { ...this.mapping, bindings: {} });
    listenToPointer(canvas, (message) => {
      pointer.handle(message);
      this.#showPointer(pointer);
    });
    listenToKeyboard(frame, commands, velocity, getMapping, { showKeys: ignore, onEscape: ignore });
    listenToMouse(canvas, frame, commands, getMapping);
    // A finger on a ring drags the limb; elsewhere it scrolls the page.
    canvas.addEventListener("touchstart", (event) => "pulling" in canvas.dataset && event.preventDefault(), {
      passive: false,
    });
    document.addEventListener("visibilitychange", this.#onVisibilityChange);
    const resizeObserver = new ResizeObserver(() => this.#resize());
    const visibilityObserver = new IntersectionObserver(
      (entries) => (this.#isVisible = entries.at(-1)?.isIntersecting ?? true),
    );
    for (const observer of [resizeObserver, visibilityObserver]) {
      this.#observers.push(observer);
      observer.observe(frame);
    }
    this.#resize();
    if (this.#playback) this.stageController.setPlayback(this.#playback);
    this.#frameLoop = new FrameLoop(
      () => this.#draw(),
      () => this.#isVisible && (this.stageController?.stage.isLate ?? false),
    );
    return null;
  }

  /** Stop drawing and free the graphics. */
  close(): void {
    this.#closed = true;
    this.#frameLoop?.stop();
    for (const observer of this.#observers) observer.disconnect();
    document.removeEventListener("visibilitychange", this.#onVisibilityChange);
    this.stageController?.stage.dispose();
    this.stageController = null;
  }

  readonly #onVisibilityChange = () => {
    if (document.hidden) this.stageController?.releaseInputs();
  };

  #resize(): void {
    const { clientWidth: width, clientHeight: height } = this.view.frame;
    if (width === 0 || height === 0) return;
    // A bar at the bottom covers the same area as the page's transport.
    const framing =
      width < PORTRAIT_MAX_ASPECT_RATIO * height
        ? "phone"
        : this.#controls && height >= SIDE_BAR_MAX_HEIGHT_PX
          ? "desktop"
          : "alone";
    this.stageController?.stage.resize(width, height, framing, devicePixelRatio);
  }

  #showPointer({ hoveredLimb, isDragging }: PointerInput): void {
    showPointerState(this.view.canvas, { isPointerNear: hoveredLimb !== null, isPulling: isDragging });
  }

  #draw(): void {
    const { stageController } = this;
    if (!stageController || !this.#isVisible) return;
    const now = performance.now();
    const { pose, limbs } = stageController.draw(now, this.focusedLimb);
    const { stage } = stageController;
    this.#showPointer(stageController.pointer);
    const bars = pose ? limbs.map((_, limb) => stage.barBox(limb)) : [];
    const anchors = { limbs, bars, faces: stage.faceBoxes, hand: null };
    this.view.placeNameTags(anchors, stageController.selectedPerformer, now);
    this.#playback?.viewer.recordFrame(performance.now() - now);
    if (!pose || this.#firstPoseReported) return;
    this.#firstPoseReported = true;
    this.onFirstPose();
  }
}
