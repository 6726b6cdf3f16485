/** One stage at work: from when its element comes into a document until it has left it. The element's wiring. */

import { ClaimController } from "../app/claim-controller";
import { findOrCreateSession, Playback } from "../app/playback";
import { SoundController } from "../app/sound-controller";
import type { SoundPreferenceStore } from "../audio/preference";
import { Access, tabToken } from "../client/access";
import { ProblemError } from "../client/problem";
import { diagnoseUnreachable } from "../client/server-diagnosis";
import type { Translator } from "../i18n/translator";
import { resolveDisplayName } from "../ui/display-name";
import { ElementRenderer } from "./renderer";
import { parseStageAddress, type StageAddress } from "./stage-address";
import { createElementView, type ElementView } from "./view";

/** What its element is told: the name of an event, and its detail. */
export type EmitEvent = (event: "ready" | "welcome" | "presence" | "closed" | "error", detail?: unknown) => void;

/** A server that is away is asked again after this, milliseconds. */
const RETRY_INTERVAL_MS = 4_000;
/** The status of one that says so itself. */
const HTTP_SERVICE_UNAVAILABLE = 503;

export class ElementController {
  playback: Playback | null = null;
  readonly renderer: ElementRenderer;
  readonly soundController: SoundController;
  readonly #view: ElementView;
  readonly #limbController: ClaimController;
  #controls = false;
  /** Whether there is sound to be heard. */
  #hasSound = false;
  #closed = false;
  #graphicsFailed = false;
  #shownError: string | null = null;
  #retryTimer: ReturnType<typeof setTimeout> | undefined;
  /** Counts what was asked for: what comes too late is not shown. */
  #requestCount = 0;

  /** In `root`; all that it says it says in `speech`. `memory` knows whether sound is wanted. */
  constructor(
    private readonly root: ShadowRoot,
    private readonly translator: Translator,
    memory: SoundPreferenceStore,
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
    const { toast, limbRequests: asks } = this.#view;
    this.#limbController = new ClaimController(
      {
        limbRequests: asks,
        toast,
        strings: {
          render: (limbs, ready, chosen) => this.#view.renderLimbs(limbs, this.#canClaimLimbs, ready, chosen),
          notice: (text) => toast(text),
        },
      },
      () => this.renderer.mapping,
      translator,
    );
    this.#limbController.viewOnly = true;
    this.soundController = new SoundController(
      ({ there, heard }) => {
        this.#view.setSound(there, heard);
        this.#hasSound = there;
        this.#updateBar();
      },
      this.#view.soundButton,
      memory,
    );
    this.renderer = new ElementRenderer(this.#view, this.#limbController);
    this.renderer.onFirstPose = () => this.emit("ready");
    void this.#startRenderer();
  }

  get playing(): boolean {
    return this.playback?.viewer.timeline?.playing ?? false;
  }

  /** Plays or pauses: a session for everyone, where that is allowed. */
  setPlaying(playing: boolean): void {
    this.playback?.edit({ playing });
  }

  seek(seconds: number): void {
    this.playback?.seek(seconds, performance.now());
  }

  /** Shows what `src` names (null: nothing), with controls or only to be watched. */
  async show(src: string | null, controls: boolean): Promise<void> {
    const asked = ++this.#requestCount;
    this.#controls = controls;
    this.#closePlayback();
    this.renderer.controls = controls;
    // without graphics nothing is asked for
    if (this.#graphicsFailed) return;
    this.#clearError();
    if (src === null) return;
    const source = parseStageAddress(src, document.baseURI);
    const { translate } = this.translator;
    if (!source)
      return this.#showError(
        translate("No stage is here"),
        translate("{address} is no address of a stage.", { address: JSON.stringify(src) }),
      );
    const own = source.server === location.origin ? tabToken() : null;
    await this.#openAddress(source, new Access(source.server, source.token ?? own, this.translator), asked);
  }

  /** Ends it for good: its sockets, its listening and its graphics. */
  close(): void {
    this.#closed = true;
    this.#closePlayback();
    this.soundController.close();
    this.renderer.close();
    this.#view.remove();
  }

  /** Whether limbs can be taken from here. */
  get #canClaimLimbs(): boolean {
    return this.#controls && this.playback?.kind === "sessions" && this.playback.access.allows("control");
  }

  /** Enters what a source names, and tries again while its server is away. */
  async #openAddress(source: StageAddress, access: Access, asked: number): Promise<void> {
    const { translate } = this.translator;
    try {
      const id = source.id ?? (await findOrCreateSession(Promise.resolve(null), access))?.id ?? null;
      if (asked !== this.#requestCount || this.#closed) return;
      if (id === null)
        this.#showError(
          translate("The stage is empty"),
          translate("Nobody dances here now. Come again when somebody does."),
        );
      else this.#openPlayback(source, id, access);
    } catch (error) {
      if (asked !== this.#requestCount || this.#closed) return;
      if (!(error instanceof ProblemError)) throw error;
      const final =
        error.status === 0
          ? await this.#reportUnreachable(source.server, asked)
          : error.status !== HTTP_SERVICE_UNAVAILABLE;
      if (error.status !== 0) this.#showProblem(error);
      if (final || asked !== this.#requestCount || this.#closed) return;
      this.#retryTimer = setTimeout(() => void this.#openAddress(source, access, asked), RETRY_INTERVAL_MS);
    }
  }

  #openPlayback({ kind: place, query, server }: StageAddress, id: string, access: Access): void {
    const asked = this.#requestCount;
    const { translate } = this.translator;
    const failed = (error: unknown) => this.#view.toast(error instanceof ProblemError ? error.message : String(error));
    const room = new Playback(id, resolveDisplayName(query, Math.random()), failed, {
      kind: place,
      access,
      viewOnly: !this.#controls,
    });
    this.playback = room;
    const { viewer, puppeteer } = room;
    let denied = false;
    let opened = false;
    access.onUnauthorized((problem) => {
      denied = true;
      if (this.playback === room) this.#showProblem(problem);
    });
    this.#limbController.viewOnly = !this.#canClaimLimbs;
    this.#limbController.setPlayback(room);
    this.renderer.setPlayback(room);
    this.soundController.setViewer(viewer);
    (this.root.host as HTMLElement).toggleAttribute("data-hands", this.#canClaimLimbs);
    const during = (target: EventTarget, event: string, then: (event: Event) => void) =>
      target.addEventListener(event, (told) => {
        if (this.playback === room) then(told);
      });
    for (const news of ["figure", "tracks"])
      during(viewer, news, () => this.renderer.stageController?.updatePerformers());
    during(viewer, "timeline", () => this.#updateBar());
    during(viewer, "presence", () => this.emit("presence", viewer.presence));
    during(puppeteer, "welcome", () => this.emit("welcome", { id: puppeteer.id, colour: puppeteer.colour }));
    during(viewer, "open", () => {
      // asked for less motion, a dance of one's own waits
      if (this.renderer.still && !opened && place === "motions") room.edit({ playing: false });
      opened = true;
      this.#limbController.connected = true;
      this.#limbController.render();
      this.#view.toast.showDisconnected(null);
      this.#clearError();
    });
    during(viewer, "closed", (event) => {
      const reason = String((event as CustomEvent<string>).detail);
      const wasConnected = this.#limbController.connected;
      this.#limbController.connected = false;
      this.#limbController.render();
      this.emit("closed", { reason, final: viewer.isClosed });
      if (viewer.isClosed || denied) this.#view.toast.showDisconnected(null);
      if (denied) return;
      if (viewer.isClosed)
        this.#view.notice(translate(place === "motions" ? "The dance has ended" : "The session has ended"), reason);
      else if (!opened) void this.#reportUnreachable(server, asked);
      else if (wasConnected) this.#view.toast.showDisconnected(translate("The line was lost: {reason}", { reason }));
    });
    this.#updateBar();
    this.#limbController.render();
  }

  #closePlayback(): void {
    const { playback: room } = this;
    clearTimeout(this.#retryTimer);
    this.playback = null;
    this.renderer.setPlayback(null);
    this.soundController.setViewer(null);
    this.#limbController.connected = false;
    room?.close();
    (this.root.host as HTMLElement).removeAttribute("data-hands");
    this.#view.toast.showDisconnected(null);
    this.#view.setBar(false, null);
  }

  /** Says why no word comes from a server, and gives up, and returns true, where none will. */
  async #reportUnreachable(server: string, asked: number): Promise<boolean> {
    const { translate } = this.translator;
    const why = await diagnoseUnreachable(server, location.origin, this.translator);
    // it can be reached, but what was asked of it cannot be had
    const {
      title,
      text,
      isFinal: final,
    } = why ?? {
      title: translate("The stage does not answer"),
      text: translate("Its server cannot show it now. It is tried again and again."),
      isFinal: false,
    };
    if (asked !== this.#requestCount || this.#closed || this.#limbController.connected) return false;
    if (final) this.#closePlayback();
    this.#showError(title, text);
    return final;
  }

  #showProblem({ title, detail, hint }: ProblemError): void {
    this.#showError(title, hint ? this.translator.translate("{detail}; {hint}.", { detail, hint }) : detail);
  }

  /** Says what is in the way: once, however often it is met. */
  #showError(title: string, text: string): void {
    const said = this.translator.translate("{title}: {detail}", { title, detail: text });
    if (said === this.#shownError) return;
    this.#shownError = said;
    this.#view.notice(title, text);
    this.emit("error", said);
  }

  #clearError(): void {
    this.#shownError = null;
    this.#view.notice(null);
  }

  #updateBar(): void {
    const { playback: room } = this;
    const editable = room?.isEditable ?? false;
    this.#view.setBar(
      this.#controls && room !== null && (editable || this.#canClaimLimbs || this.#hasSound),
      editable ? this.playing : null,
    );
  }

  async #startRenderer(): Promise<void> {
    const missing = await this.renderer.start({
      next_dancer: () => this.#limbController.selectNextPerformer(),
      ask: () => this.#limbController.requestLimb(),
      give: () => this.#limbController.handOver(),
      play: () => this.setPlaying(!this.playing),
      sound: () => this.soundController.toggle(),
      back: () => this.playback?.seekByBlocks(-1, performance.now()),
      forward: () => this.playback?.seekByBlocks(1, performance.now()),
    });
    if (!missing) return;
    this.#graphicsFailed = true;
    this.#requestCount++;
    this.#closePlayback();
    const { translate } = this.translator;
    if (missing === "not loaded")
      this.#showError(
        translate("The stage does not answer"),
        translate("What draws it could not be loaded. Load this page again."),
      );
    else
      this.#showError(
        translate("This browser cannot draw the stage"),
        translate("It needs WebGL 2. Try another browser, or switch on hardware acceleration."),
      );
  }
}
