/** Stage of the page: starts the engine, passes the inputs to it, and shows what it reports. */
import { AvatarError } from "../avatar/error";
import type { CameraKeyframe } from "../client/api";
import type { ClaimState } from "../engine/claim-controller";
import type { EngineEvent, EngineResults, EngineSettings } from "../engine/message";
import type { PropRefusalReason } from "../engine/prop-request";
import { translate } from "../i18n/translator";
import { createGamepadInput } from "../input/gamepad";
import { listenToKeyboard } from "../input/keyboard";
import type { Mapping } from "../input/mapping";
import { listenToMouse } from "../input/mouse";
import { listenToPointer } from "../input/pointer-events";
import { LIMBS } from "../motion/skeleton";
import type { Theme } from "../stage/scenery/look";
import type { CrowdStatus } from "../ui/crowd/crowd-status";
import type { LimbState } from "../ui/limb-state";
import type { Page } from "../ui/page";
import type { LabelMetrics } from "../ui/strings/label-layout";
import type { StagedAvatars } from "./avatar-slot";
import { type EngineConnection, EngineError } from "./engine-connection";
import { GamepadPolling } from "./gamepad-polling";
import type { ImmersiveMode } from "./immersive-mode";
import { watchForHeadset } from "./immersive-offer";
import type { Invitation } from "./invitation";
import type { LimbControls } from "./limb-controls";
import type { PlaybackController } from "./playback-controller";
import { StageOverlay } from "./stage-overlay";
import type { StartupSequence } from "./startup";
import { describeViewport } from "./viewport";

/** Limbs of one performer before the engine has reported any. */
const NO_CLAIMS: ClaimState = {
  limbs: LIMBS.map(() => ({ holder: null, requesters: [], requestedByMe: false, selected: false })),
  isReady: false,
  performer: 0,
  giveKey: null,
  selectedLimb: null,
  holdsLimb: false,
};

export interface StageHostOptions {
  canvas: HTMLCanvasElement;
  page: Page;
  startup: StartupSequence;
  reducedMotion: MediaQueryList;
  engine: EngineConnection;
  limbs: LimbControls;
  invitation: Invitation;
  /** True if this page may not claim limbs. */
  viewOnly: boolean;
  /** True if the stage is shown without the page around it, and without inputs. */
  isAlone: boolean;
  getPlayback(): Pick<PlaybackController, "current" | "onChange" | "onTime" | "onUnauthorized">;
  getMapping(): Mapping;
  /** Return the files of the avatars that replace puppets, by performer. */
  getAvatarFiles(): readonly (File | null)[];
}

export class StageHost {
  readonly #overlay: StageOverlay;
  readonly #gamepad: GamepadPolling;
  #isReady = false;
  #limbs: readonly LimbState[] = [];
  /** Status of the limbs that are open to the audience; null while there were none. */
  #crowdStatus: CrowdStatus | null = null;
  /** VR; null while it is not loaded. */
  #immersive: ImmersiveMode | null = null;

  constructor(private readonly options: StageHostOptions) {
    const { canvas, page, limbs, getMapping } = options;
    this.#overlay = new StageOverlay(canvas, page, () => options.getPlayback().current);
    this.#gamepad = new GamepadPolling(
      createGamepadInput(limbs.commands, getMapping, () => navigator.getGamepads?.() ?? []),
      page.mappingDialog,
    );
  }

  /** Pass the state of the page and the inputs to the engine. */
  open(): void {
    const { reducedMotion } = this.options;
    this.#setSettings({
      reducedMotion: reducedMotion.matches,
      mapping: this.options.getMapping(),
      isHidden: document.hidden,
    });
    reducedMotion.addEventListener("change", () => this.#setSettings({ reducedMotion: reducedMotion.matches }));
    this.#showLimbs(NO_CLAIMS);
    this.resize();
    addEventListener("resize", () => this.resize());
    if (!this.options.isAlone) {
      this.#listenToInputs();
      this.options.startup.runWhenFinished(() => watchForHeadset(() => void this.#loadImmersive()));
    }
    // A page in the background draws no frames, so nothing would release the inputs that were pressed.
    document.addEventListener("visibilitychange", () => {
      this.#setSettings({ isHidden: document.hidden });
      if (document.hidden) this.options.limbs.commands.releaseAll();
    });
  }

  setTheme(theme: Theme): void {
    this.#setSettings({ theme });
  }

  setMapping(mapping: Mapping): void {
    this.#setSettings({ mapping });
  }

  /** Set the sizes of the labels over the stage, and the space for them. */
  setLabels(labels: LabelMetrics): void {
    this.#setSettings({ labels });
  }

  /** Poll the gamepad while the dialog of keys and gamepad is open. */
  pollGamepad(): void {
    this.#gamepad.start();
  }

  /** Follow the motion's own camera, or return to the audience's view. */
  toggleCamera(): void {
    this.options.engine.post({ type: "toggle camera" });
  }

  /** Return the stage with its strings as PNG. */
  takePicture(): Promise<Blob> {
    return this.options.engine.request({ kind: "picture" });
  }

  /** Return the camera's movement during the last loop of the motion; empty if the camera was not moved. */
  cameraKeyframes(): Promise<CameraKeyframe[]> {
    return this.options.engine.request({ kind: "camera keyframes" });
  }

  /** Put a prop into a hand, or lay it down (null). Return null once it is there, or the reason why it stays. */
  putProp(prop: number, limb: number | null): Promise<PropRefusalReason | null> {
    return this.options.engine.request({ kind: "put prop", prop, limb });
  }

  /** Put the nearest prop into a hand that this page holds, or lay down the one that is in it. */
  moveProp(): Promise<EngineResults["move prop"]> {
    return this.options.engine.request({ kind: "move prop" });
  }

  /** Avatars on the stage. */
  get avatars(): StagedAvatars {
    const { engine } = this.options;
    return {
      load: (performer, file) =>
        engine.request({ kind: "load avatar", performer, file }).catch((error: unknown) => {
          const known = error instanceof EngineError ? error.failure.known : null;
          throw known ? new AvatarError(known.title, known.detail, known.hint) : error;
        }),
      setActive: (performer, active) => engine.post({ type: "avatar active", performer, active }),
      remove: (performer) => engine.post({ type: "remove avatar", performer }),
    };
  }

  /** Fit the picture to the window, beside the panels that are open. */
  resize(): void {
    this.#setSettings({ viewport: describeViewport(this.options.isAlone, this.options.page.panels) });
  }

  /** Handle an event of the engine. */
  onEvent(event: EngineEvent): void {
    const { invitation, limbs, page, viewOnly } = this.options;
    const playback = this.options.getPlayback();
    switch (event.type) {
      case "ready":
        this.#isReady = true;
        limbs.isReady = true;
        break;
      case "unavailable":
        limbs.isReady = false;
        this.#showUnavailable(event.reason);
        break;
      case "frame":
        playback.onTime(event.playback, event.time);
        this.#overlay.update(event.changes);
        if (event.changes?.hasPose && !viewOnly) invitation.start();
        break;
      case "playback":
        playback.onChange(event.playback, event.change);
        this.#overlay.update();
        break;
      case "statistics": {
        const { current } = playback;
        playback.onTime(event.playback, event.time);
        // The sound goes on while the stage stands still and sends no frames.
        current?.sendLead(performance.now());
        // Statistics begin when the stage is drawn.
        if (current?.number !== event.playback || !this.#isReady) break;
        page.link.addSample(event.statistics, current.levelCount);
        page.transport.setHealth(page.link.assessHealth(event.statistics, event.isConnected));
        break;
      }
      case "limbs":
        this.#showLimbs(event.state);
        break;
      case "toast": {
        const { ask } = event;
        if (ask) page.toast(event.message, { label: ask.label, key: ask.key, run: () => limbs.act("ask", ask.limb) });
        else page.toast(event.message);
        break;
      }
      case "limb notice":
        page.strings.notice(event.text);
        break;
      case "page action":
        limbs.run(event.action);
        break;
      case "edit failed":
        page.toast(event.problem ? translate("{title}: {detail}", event.problem) : event.message);
        break;
      case "unauthorized":
        playback.onUnauthorized(event);
        break;
      case "graphics":
        this.#showContextLoss(event.isLost);
        break;
    }
    this.#immersive?.onEvent(event);
  }

  /** Load VR once. Without a connection it stays absent: the next headset tries again. */
  async #loadImmersive(): Promise<void> {
    const chunk = await import("./immersive-mode").catch(() => null);
    if (chunk) this.#immersive ??= new chunk.ImmersiveMode(this.options);
  }

  #setSettings(settings: Partial<EngineSettings>): void {
    this.options.engine.post({ type: "set", settings });
  }

  #showLimbs(state: ClaimState): void {
    const { invitation, page } = this.options;
    const { limbs, isReady, performer, giveKey } = state;
    this.options.limbs.update(state);
    if (state.holdsLimb) invitation.finish();
    page.nameTags.setLimbs(limbs);
    page.strings.render(limbs, isReady, performer);
    page.limbRequests.render(limbs, giveKey);
    if (this.#crowdStatus || limbs.some(({ crowd }) => crowd)) void this.#showCrowd(limbs);
    page.library.danceAs.dancers(limbs, performer);
  }

  async #showCrowd(limbs: readonly LimbState[]): Promise<void> {
    this.#limbs = limbs;
    // Without a connection it stays absent until the next change.
    const chunk = this.#crowdStatus ? null : await import("../ui/crowd/crowd-status").catch(() => null);
    const { page } = this.options;
    const getClock = () => this.options.getPlayback().current?.ownTime(performance.now()) ?? 0;
    if (chunk) this.#crowdStatus ??= chunk.createCrowdStatus(page.messageArea.element, getClock, page.toast);
    this.#crowdStatus?.render(this.#limbs);
  }

  #listenToInputs(): void {
    const { canvas, engine, limbs, page, startup, getMapping } = this.options;
    const { commands } = limbs;
    listenToKeyboard(window, commands, limbs, getMapping, {
      showKeys: () => page.mappingDialog.show(),
      onEscape: () => page.panels.closeLast(),
    });
    listenToMouse(canvas, window, commands, getMapping);
    listenToPointer(canvas, (event) => engine.post({ type: "pointer", event }));
    startup.runWhenFinished(() => {
      addEventListener("gamepadconnected", () => this.#gamepad.start());
      this.#gamepad.start();
    });
  }

  #showContextLoss(isLost: boolean): void {
    const { page } = this.options;
    if (isLost)
      page.notice(
        "graphics",
        translate("The stage went dark"),
        translate("The browser stopped the graphics. They usually return by themselves; if not, reload this page."),
      );
    else page.notice("graphics", null);
  }

  /** Report that there will be no stage. */
  #showUnavailable(reason: "graphics" | "not loaded"): void {
    this.options.page.notice(
      "graphics",
      translate("This browser cannot draw the stage"),
      reason === "graphics"
        ? translate("It needs WebGL 2. Try another browser, or switch on hardware acceleration.")
        : translate("The renderer could not be loaded. Check your connection, then reload this page."),
    );
  }
}
