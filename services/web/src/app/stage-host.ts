/** Stage of the page: load the renderer, connect its inputs, and draw every frame. */
import { translate } from "../i18n/translator";
import type { PageActions } from "../input/command-dispatcher";
import type { GamepadInput } from "../input/gamepad";
import type { Mapping } from "../input/mapping";
import { type Graphics, openGraphics } from "../stage/rendering/graphics";
import type { Theme } from "../stage/scenery/look";
import type { Stage } from "../stage/stage";
import type { Page } from "../ui/page";
import { LANDSCAPE_PHONE, PHONE } from "../ui/panel";
import type { AvatarSlots } from "./avatar-slot";
import type { ClaimController } from "./claim-controller";
import type { Invitation } from "./invitation";
import type { Playback } from "./playback";
import type { StageController } from "./stage-controller";
import type { StartupSequence } from "./startup";

const STATISTICS_INTERVAL_MS = 500;

export interface StageHostOptions {
  canvas: HTMLCanvasElement;
  page: Page;
  startup: StartupSequence;
  reducedMotion: MediaQueryList;
  /** Draw in the best quality, whatever it costs. */
  bestQuality: boolean;
  limbController: ClaimController;
  avatarSlots: AvatarSlots;
  invitation: Invitation;
  actions: PageActions;
  getMapping(): Mapping;
  getTheme(): Theme;
  getPlayback(): Playback | null;
  /** Called when the stage is ready. */
  onOpen(): void;
}

export class StageHost {
  /** Limb whose control has the focus. */
  focusedLimb: number | null = null;
  #controller: StageController | null = null;
  #gamepad: GamepadInput | null = null;
  #lastStatisticsMs = 0;

  constructor(private readonly options: StageHostOptions) {}

  /** Null until the renderer was loaded, and if it cannot be. */
  get controller(): StageController | null {
    return this.#controller;
  }

  get stage(): Stage | null {
    return this.#controller?.stage ?? null;
  }

  /** Follow the motion's own camera, or return to the audience's view. */
  toggleCamera(): void {
    this.stage?.followMotionCamera(!this.stage.followsMotionCamera);
  }

  setPlayback(playback: Playback): void {
    this.stage?.cameraRecorder.clear();
    this.#controller?.setPlayback(playback);
  }

  updatePerformers(): void {
    this.#controller?.updatePerformers();
  }

  /** Load the renderer and start drawing. Shows a notice if this browser cannot. */
  async open(): Promise<void> {
    const { canvas, bestQuality } = this.options;
    let graphics: Graphics;
    try {
      graphics = openGraphics(canvas, bestQuality);
    } catch {
      this.#showUnavailable(translate("It needs WebGL 2. Try another browser, or switch on hardware acceleration."));
      return;
    }
    const chunk = await import("./stage-chunk").catch(() => null);
    if (!chunk) {
      this.#showUnavailable(
        translate("The renderer could not be loaded. Check your connection, then reload this page."),
      );
      return;
    }
    // Handle messages that arrived meanwhile first: the requests they lead to are sent before the stage is built.
    await new Promise((resolve) => setTimeout(resolve));
    this.#build(chunk, graphics);
    this.options.onOpen();
    this.resize();
    addEventListener("resize", () => this.resize());
    this.options.startup.onStageReady();
    requestAnimationFrame(() => this.#drawFrame());
  }

  /** Fit the picture to the window, beside the panels that are open. */
  resize(): void {
    const { panels } = this.options.page;
    const framing = LANDSCAPE_PHONE.matches
      ? "sideways"
      : !PHONE.matches
        ? "desktop"
        : panels.isSheetOpen
          ? "sheet"
          : "phone";
    this.stage?.resize(
      innerWidth,
      innerHeight,
      framing,
      devicePixelRatio,
      framing === "desktop" || framing === "sideways" ? panels.sideInsets : [0, 0],
      panels.bottomInset,
    );
  }

  #build(chunk: typeof import("./stage-chunk"), graphics: Graphics): void {
    const { canvas, page, limbController, reducedMotion, avatarSlots, getMapping } = this.options;
    const controller = new chunk.StageController(canvas, limbController, {
      getMapping,
      actions: this.options.actions,
      onClaimsChange: () => this.#onClaimsChange(),
      graphics,
    });
    this.#controller = controller;
    const { stage, commands, velocity } = controller;
    this.#reportContextLoss();
    stage.reducedMotion = reducedMotion.matches;
    reducedMotion.addEventListener("change", () => (stage.reducedMotion = reducedMotion.matches));
    stage.setTheme(this.options.getTheme());
    avatarSlots.stage = stage;
    chunk.listenToKeyboard(window, commands, velocity, getMapping, {
      showKeys: () => page.mappingDialog.show(),
      onEscape: () => page.panels.closeLast(),
    });
    chunk.listenToMouse(canvas, window, commands, getMapping);
    this.#gamepad = chunk.createGamepadInput(commands, getMapping, () => navigator.getGamepads());
    const playback = this.options.getPlayback();
    if (playback) controller.setPlayback(playback);
    // A page in the background draws no frames, so nothing would release the inputs that were pressed.
    document.addEventListener("visibilitychange", () => {
      if (document.hidden) controller.releaseInputs();
    });
  }

  #onClaimsChange(): void {
    if (this.#controller?.hands.isHoldingAny) this.options.invitation.finish();
    this.options.limbController.render();
  }

  #reportContextLoss(): void {
    const { canvas, page } = this.options;
    canvas.addEventListener("webglcontextlost", () =>
      page.notice(
        "graphics",
        translate("The stage went dark"),
        translate("The browser stopped the graphics. They usually return by themselves; if not, reload this page."),
      ),
    );
    canvas.addEventListener("webglcontextrestored", () => page.notice("graphics", null));
  }

  /** Report that there will be no stage, and run the callbacks that wait for the first frame. */
  #showUnavailable(reason: string): void {
    this.options.startup.finish();
    this.options.page.notice("graphics", translate("This browser cannot draw the stage"), reason);
  }

  #drawFrame(): void {
    requestAnimationFrame(() => this.#drawFrame());
    const { limbController, invitation, page, startup } = this.options;
    const { stage } = this;
    if (!stage || !this.#controller) return;
    const now = performance.now();
    this.#updateGamepad(stage, now);
    const { pose, limbs } = this.#controller.draw(now, this.focusedLimb);
    const { faceBoxes } = stage;
    page.nameTags.render(
      limbs,
      pose ? limbs.map((_, limb) => stage.barBox(limb)) : [],
      faceBoxes,
      now,
      limbController.selectedPerformer.performer,
    );
    page.messageArea.avoidFaces(faceBoxes);
    if (pose && !limbController.viewOnly) invitation.update(now, stage);
    if (stage.hasDrawnPerformer) startup.finish();
    page.transport.setCamera(stage.hasMotionCamera, stage.followsMotionCamera);
    this.#renderPlayback(now);
  }

  #updateGamepad(stage: Stage, now: number): void {
    const { mappingDialog } = this.options.page;
    // Browsers start to look for gamepads when they are first polled.
    if (stage.hasDrawnPerformer || mappingDialog.isOpen) this.#gamepad?.update(now, !mappingDialog.isCapturing);
    if (mappingDialog.isOpen) mappingDialog.updateGamepad(this.#gamepad?.pad ?? null);
  }

  /** Show position and statistics of the playback, and record how long the frame that began at `now` took. */
  #renderPlayback(now: number): void {
    const { page, limbController } = this.options;
    const playback = this.options.getPlayback();
    if (!playback) return;
    const { viewer } = playback;
    page.transport.setPosition(playback.position(now), viewer.duration);
    if (now - this.#lastStatisticsMs >= STATISTICS_INTERVAL_MS) {
      this.#lastStatisticsMs = now;
      const statistics = viewer.statistics();
      page.link.addSample(statistics, viewer.ladder.length);
      page.transport.setHealth(page.link.assessHealth(statistics, limbController.connected));
    }
    viewer.recordFrame(performance.now() - now);
  }
}
