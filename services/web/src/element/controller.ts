/** Controller of one `<bunraku-stage>`, from the insertion of the element into a document until its removal. */
import { SoundController } from "../app/sound-controller";
import type { SoundPreferenceStore } from "../audio/preference";
import { Access, tabToken } from "../client/access";
import { findOrCreateSession } from "../client/api";
import { ProblemError } from "../client/problem";
import { diagnoseUnreachable } from "../client/server-diagnosis";
import { ClaimController } from "../engine/claim-controller";
import { Playback } from "../engine/playback";
import type { Translator } from "../i18n/translator";
import { resolveDisplayName } from "../ui/display-name";
import { ElementRenderer } from "./renderer";
import { parseStageAddress, type StageAddress } from "./stage-address";
import { createElementView, type ElementView } from "./view";

/** Dispatch an event on the element. */
export type EmitEvent = (event: "ready" | "welcome" | "presence" | "closed" | "error", detail?: unknown) => void;

/** Interval between attempts to reach a server that is unavailable. */
const RETRY_INTERVAL_MS = 4_000;
const HTTP_SERVICE_UNAVAILABLE = 503;

export class ElementController {
  playback: Playback | null = null;
  readonly renderer: ElementRenderer;
  readonly soundController: SoundController;
  readonly #view: ElementView;
  readonly #limbController: ClaimController;
  #controls = false;
  /** True if the motion has sound. */
  #hasSound = false;
  #closed = false;
  #graphicsFailed = false;
  #shownError: string | null = null;
  #retryTimer: ReturnType<typeof setTimeout> | undefined;
  /** Number of calls of `show`. Results of earlier calls are discarded. */
  #requestCount = 0;

  constructor(
    private readonly root: ShadowRoot,
    private readonly translator: Translator,
    soundPreference: SoundPreferenceStore,
    private readonly emit: EmitEvent,
  ) {
    this.#view = createElementView(
      root,
      {
        play: () => this.setPlaying(!this.playing),
        toggle: (limb) => this.#limbController.toggleClaim(limb),
        focus: (limb) => (this.renderer.focusedLimb = limb),
        ask: (limb) => this.#limbController.requestLimb(limb),
        give: (limb) => this.#limbController.handOver(limb),
        nextDancer: () => this.#limbController.selectNextPerformer(),
        sound: () => this.soundController.toggle(),
      },
      translator,
    );
    const { toast, limbRequests } = this.#view;
    this.#limbController = new ClaimController(
      {
        render: ({ limbs, isReady, performer, giveKey }) => {
          this.#view.renderLimbs(limbs, this.#canClaimLimbs, isReady, performer);
          limbRequests.render(limbs, giveKey);
        },
        toast: (message, offer) => {
          if (!offer) return toast(message);
          const { label, key, limb } = offer;
          toast(message, { label, key, run: () => this.#limbController.requestLimb(limb) });
        },
        notice: (text) => toast(text),
      },
      () => this.renderer.mapping,
      translator,
    );
    this.#limbController.viewOnly = true;
    this.soundController = new SoundController(
      ({ available, audible }) => {
        this.#view.setSound(available, audible);
        this.#hasSound = available;
        this.#updateBar();
      },
      this.#view.soundButton,
      soundPreference,
      () => this.#view.toast(this.translator.translate("This browser plays no sound here. Check its audio device.")),
    );
    this.renderer = new ElementRenderer(this.#view, this.#limbController);
    this.renderer.onFirstPose = () => this.emit("ready");
    void this.#startRenderer();
  }

  get playing(): boolean {
    return this.playback?.viewer.timeline?.playing ?? false;
  }

  /** Play or pause; a session for all its viewers, if this page may. */
  setPlaying(playing: boolean): void {
    this.playback?.edit({ playing });
  }

  seek(seconds: number): void {
    this.playback?.seek(seconds, performance.now());
  }

  /** Show the stage at the address `src` (null for none), with or without controls. */
  async show(src: string | null, controls: boolean): Promise<void> {
    const request = ++this.#requestCount;
    this.#controls = controls;
    this.#closePlayback();
    this.renderer.controls = controls;
    // Without graphics no request is made.
    if (this.#graphicsFailed) return;
    this.#clearError();
    if (src === null) return;
    const address = parseStageAddress(src, document.baseURI);
    const { translate } = this.translator;
    if (!address)
      return this.#showError(
        translate("No stage here"),
        translate("{address} is not the address of a stage. Check the src attribute.", {
          address: JSON.stringify(src),
        }),
      );
    const pageToken = address.server === location.origin ? tabToken() : null;
    const access = new Access(address.server, address.token ?? pageToken, this.translator);
    await this.#openAddress(address, access, request);
  }

  /** Close connections, sound and graphics. */
  close(): void {
    this.#closed = true;
    this.#closePlayback();
    this.soundController.close();
    this.renderer.close();
    this.#view.remove();
  }

  /** True if this element may claim limbs. */
  get #canClaimLimbs(): boolean {
    return this.#controls && this.playback?.kind === "sessions" && this.playback.access.allows("control");
  }

  /** Open the session or motion at an address; retry while its server is unavailable. */
  async #openAddress(address: StageAddress, access: Access, request: number): Promise<void> {
    const { translate } = this.translator;
    try {
      const id = address.id ?? (await findOrCreateSession(Promise.resolve(null), access))?.id ?? null;
      if (request !== this.#requestCount || this.#closed) return;
      if (id === null)
        this.#showError(translate("The stage is empty"), translate("No performance is running now. Come back later."));
      else this.#openPlayback(address, id, access);
    } catch (error) {
      if (request !== this.#requestCount || this.#closed) return;
      if (!(error instanceof ProblemError)) throw error;
      const isFinal =
        error.status === 0
          ? await this.#reportUnreachable(address.server, request)
          : error.status !== HTTP_SERVICE_UNAVAILABLE;
      if (error.status !== 0) this.#showProblem(error);
      if (isFinal || request !== this.#requestCount || this.#closed) return;
      this.#retryTimer = setTimeout(() => void this.#openAddress(address, access, request), RETRY_INTERVAL_MS);
    }
  }

  #openPlayback({ kind, query, server }: StageAddress, id: string, access: Access): void {
    const request = this.#requestCount;
    const { translate } = this.translator;
    const onEditError = (error: unknown) =>
      this.#view.toast(error instanceof ProblemError ? error.message : String(error));
    const playback = new Playback(id, resolveDisplayName(query, Math.random()), onEditError, {
      kind,
      access,
      viewOnly: !this.#controls,
    });
    this.playback = playback;
    const { viewer, puppeteer } = playback;
    let denied = false;
    let opened = false;
    access.onUnauthorized((problem) => {
      denied = true;
      if (this.playback === playback) this.#showProblem(problem);
    });
    this.#limbController.viewOnly = !this.#canClaimLimbs;
    this.#limbController.setPlayback(playback);
    this.renderer.setPlayback(playback);
    this.soundController.setViewer(viewer);
    (this.root.host as HTMLElement).toggleAttribute("data-hands", this.#canClaimLimbs);
    const on = (target: EventTarget, type: string, listener: (event: Event) => void) =>
      target.addEventListener(type, (event) => {
        if (this.playback === playback) listener(event);
      });
    for (const type of ["figure", "tracks"]) on(viewer, type, () => this.renderer.stageController?.updatePerformers());
    on(viewer, "timeline", () => this.#updateBar());
    on(viewer, "presence", () => this.emit("presence", viewer.presence));
    on(puppeteer, "welcome", () => this.emit("welcome", { id: puppeteer.id, colour: puppeteer.colour }));
    on(viewer, "open", () => {
      // With reduced motion, a motion that only this element shows starts paused.
      if (this.renderer.still && !opened && kind === "motions") playback.edit({ playing: false });
      opened = true;
      this.#limbController.connected = true;
      this.#limbController.render();
      this.#view.toast.showDisconnected(null);
      this.#clearError();
    });
    on(viewer, "closed", (event) => {
      const reason = String((event as CustomEvent<string>).detail);
      const wasConnected = this.#limbController.connected;
      this.#limbController.connected = false;
      this.#limbController.render();
      this.emit("closed", { reason, final: viewer.isClosed });
      if (viewer.isClosed || denied) this.#view.toast.showDisconnected(null);
      if (denied) return;
      if (viewer.isClosed)
        this.#view.notice(translate(kind === "motions" ? "The dance has ended" : "The session has ended"), reason);
      else if (!opened) void this.#reportUnreachable(server, request);
      else if (wasConnected)
        this.#view.toast.showDisconnected(translate("Connection lost, reconnecting: {reason}", { reason }));
    });
    this.#updateBar();
    this.#limbController.render();
  }

  #closePlayback(): void {
    const { playback } = this;
    clearTimeout(this.#retryTimer);
    this.playback = null;
    this.renderer.setPlayback(null);
    this.soundController.setViewer(null);
    this.#limbController.connected = false;
    playback?.close();
    (this.root.host as HTMLElement).removeAttribute("data-hands");
    this.#view.toast.showDisconnected(null);
    this.#view.setBar(false, null);
  }

  /** Show why a server cannot be reached. Returns true, and gives up, if retrying is useless. */
  async #reportUnreachable(server: string, request: number): Promise<boolean> {
    const { translate } = this.translator;
    const diagnosis = await diagnoseUnreachable(server, location.origin, this.translator);
    // Without a diagnosis the server can be reached, but not the session or motion.
    const { title, text, isFinal } = diagnosis ?? {
      title: translate("The stage does not answer"),
      text: translate("The server cannot show it now. Retrying automatically."),
      isFinal: false,
    };
    if (request !== this.#requestCount || this.#closed || this.#limbController.connected) return false;
    if (isFinal) this.#closePlayback();
    this.#showError(title, text);
    return isFinal;
  }

  #showProblem({ title, detail, hint }: ProblemError): void {
    this.#showError(title, hint ? this.translator.translate("{detail}; {hint}.", { detail, hint }) : detail);
  }

  /** Show an error and dispatch it as an event, unless it is shown already. */
  #showError(title: string, text: string): void {
    const message = this.translator.translate("{title}: {detail}", { title, detail: text });
    if (message === this.#shownError) return;
    this.#shownError = message;
    this.#view.notice(title, text);
    this.emit("error", message);
  }

  #clearError(): void {
    this.#shownError = null;
    this.#view.notice(null);
  }

  #updateBar(): void {
    const { playback } = this;
    const isEditable = playback?.isEditable ?? false;
    // A sound that is found later would move the buttons under a pointer.
    const isKnown = Boolean(playback?.viewer.figure);
    this.#view.setBar(
      this.#controls && isKnown && (isEditable || this.#canClaimLimbs || this.#hasSound),
      isEditable ? this.playing : null,
    );
  }

  async #startRenderer(): Promise<void> {
    const failure = await this.renderer.start({
      next_dancer: () => this.#limbController.selectNextPerformer(),
      ask: () => this.#limbController.requestLimb(),
      give: () => this.#limbController.handOver(),
      join: () => this.#limbController.joinHands(),
      play: () => this.setPlaying(!this.playing),
      sound: () => this.soundController.toggle(),
      back: () => this.playback?.seekByBlocks(-1, performance.now()),
      forward: () => this.playback?.seekByBlocks(1, performance.now()),
    });
    if (!failure) return;
    this.#graphicsFailed = true;
    this.#requestCount++;
    this.#closePlayback();
    const { translate } = this.translator;
    if (failure === "not loaded")
      this.#showError(
        translate("The stage does not answer"),
        translate("The renderer could not be loaded. Check your connection, then reload this page."),
      );
    else
      this.#showError(
        translate("This browser cannot draw the stage"),
        translate("It needs WebGL 2. Try another browser, or switch on hardware acceleration."),
      );
  }
}
