/** The picture of a showing: what its room shows, drawn in the size of its element while that is in sight. */
import type { ClaimController } from "../app/claim-controller";
import type { Playback } from "../app/playback";
import type { StageController } from "../app/stage-controller";
import type { PageActions } from "../input/command-dispatcher";
import { ACTIONS, type Mapping } from "../input/mapping";
import { loadMapping } from "../input/mapping-store";
import type { Theme } from "../stage/scenery/look";
import type { ElementView } from "./view";

/** Narrower than this share of its height, a picture is framed as a phone's. */
const PORTRAIT_MAX_ASPECT_RATIO = 0.7;
/** In a picture lower than this the bar stands at its side, pixels (`element.css`). */
const SIDE_BAR_MAX_HEIGHT_PX = 380;

/** What keys do beside taking limbs; what else they do is the page's. */
export type ElementKeyActions = Pick<
  PageActions,
  "next_dancer" | "ask" | "give" | "play" | "back" | "forward" | "sound"
>;

export class ElementRenderer {
  stageController: StageController | null = null;
  /** The limb whose button has the focus. */
  focusedLimb: number | null = null;
  /** Told of the first pose of a room. */
  onFirstPose: () => void = () => undefined;
  readonly mapping: Mapping = loadMapping();
  #playback: Playback | null = null;
  #theme: Theme = "night";
  #still = false;
  #controls = false;
  #isVisible = true;
  #firstPoseReported = false;
  #closed = false;
  #animationFrame = 0;
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

  /** Whether the bar is there, for which the picture makes room, and keys are heard. */
  set controls(controls: boolean) {
    this.#controls = controls;
    this.#resize();
  }

  /** The room to draw from now on; null leaves the last picture. */
  setPlayback(playback: Playback | null): void {
    this.#playback = playback;
    this.#firstPoseReported = false;
    this.stageController?.setPlayback(playback);
  }

  /** Loads what draws and begins; what is in the way where that cannot be. */
  async start(keyActions: ElementKeyActions): Promise<"not loaded" | "no graphics" | null> {
    const theatre = await import("../app/stage-chunk").catch(() => null);
    if (this.#closed) return null;
    if (!theatre) return "not loaded";
    const { listenToKeyboard, listenToMouse, Performing } = theatre;
    const { canvas, frame } = this.view;
    const nothing = () => undefined;
    const idle = Object.fromEntries(ACTIONS.map((action) => [action, nothing])) as PageActions;
    const camera = () =>
      this.stageController?.stage.followMotionCamera(!this.stageController.stage.followsMotionCamera);
    const actions: PageActions = { ...idle, camera, ...keyActions };
    try {
      this.stageController = new Performing(canvas, this.limbController, {
        getMapping: () => this.mapping,
        actions,
        onClaimsChange: () => this.limbController.render(),
      });
    } catch {
      return "no graphics";
    }
    const { stage, commands, velocity } = this.stageController;
    stage.reducedMotion = this.#still;
    stage.setTheme(this.#theme);
    const keys = () => (this.#controls ? this.mapping : { ...this.mapping, bindings: {} });
    listenToKeyboard(frame, commands, velocity, keys, { showKeys: nothing, onEscape: nothing });
    listenToMouse(canvas, frame, commands, keys);
    // a finger on a ring pulls it; elsewhere it turns over the page
    canvas.addEventListener("touchstart", (event) => "pulling" in canvas.dataset && event.preventDefault(), {
      passive: false,
    });
    document.addEventListener("visibilitychange", this.#onVisibilityChange);
    const sizes = new ResizeObserver(() => this.#resize());
    const sight = new IntersectionObserver((entries) => (this.#isVisible = entries.at(-1)?.isIntersecting ?? true));
    this.#observers.push(sizes, sight);
    for (const observer of [sizes, sight]) observer.observe(frame);
    this.#resize();
    if (this.#playback) this.stageController.setPlayback(this.#playback);
    this.#animationFrame = requestAnimationFrame(() => this.#draw());
    return null;
  }

  /** Ends it for good, and gives the graphics back. */
  close(): void {
    this.#closed = true;
    cancelAnimationFrame(this.#animationFrame);
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
    // a bar below stands where the page's does
    const framing =
      width < PORTRAIT_MAX_ASPECT_RATIO * height
        ? "phone"
        : this.#controls && height >= SIDE_BAR_MAX_HEIGHT_PX
          ? "desktop"
          : "alone";
    this.stageController?.stage.resize(width, height, framing, devicePixelRatio);
  }

  #draw(): void {
    this.#animationFrame = requestAnimationFrame(() => this.#draw());
    const { stageController: performing } = this;
    if (!performing || !this.#isVisible) return;
    const now = performance.now();
    const { pose, limbs } = performing.draw(now, this.focusedLimb);
    const { stage } = performing;
    this.view.nameTags.render(
      limbs,
      pose ? limbs.map((_, limb) => stage.barBox(limb)) : [],
      stage.faceBoxes,
      now,
      this.limbController.selectedPerformer.performer,
    );
    this.#playback?.viewer.recordFrame(performance.now() - now);
    if (!pose || this.#firstPoseReported) return;
    this.#firstPoseReported = true;
    this.onFirstPose();
  }
}
