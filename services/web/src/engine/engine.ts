/**
 * The engine of a page: connections, decoding, limbs and rendering. It runs in a worker, or in the page where workers
 * cannot draw, and knows the page only by messages.
 */
import { AvatarError } from "../avatar/error";
import { Access } from "../client/access";
import { ProblemError } from "../client/problem";
import { createPageActions } from "../input/command-dispatcher";
import type { HandState } from "../input/hand";
import { DEFAULT_MAPPING } from "../input/mapping";
import type { Figure } from "../motion/skeleton";
import type { Detail } from "../stage/puppet/surface";
import type { StageCanvas } from "../stage/rendering/canvas";
import { type Graphics, openGraphics } from "../stage/rendering/graphics";
import { LabelLayout, NO_LABELS } from "../ui/strings/label-layout";
import { AvatarModels } from "./avatar-models";
import { changedParts } from "./changed-parts";
import { ClaimController, type ClaimState } from "./claim-controller";
import { FrameLoop } from "./frame-loop";
import type { ImmersiveController } from "./immersive-controller";
import type {
  EngineCommand,
  EngineEvent,
  EngineFailure,
  EngineOptions,
  EngineRequest,
  EngineResults,
  EngineSettings,
  LimbAction,
  PlaybackRequest,
  StageState,
  ViewerTime,
} from "./message";
import { Playback } from "./playback";
import { publishPlayback } from "./playback-publisher";
import type { StageController } from "./stage-controller";

const STATISTICS_INTERVAL_MS = 500;

/** Settings until the page sends its own. */
const INITIAL_SETTINGS: EngineSettings = {
  theme: "night",
  reducedMotion: false,
  mapping: DEFAULT_MAPPING,
  focusedLimb: null,
  isHidden: false,
  viewport: { width: 1, height: 1, framing: "desktop", pixelRatio: 1, sideInsets: [0, 0], bottomInset: 0 },
  labels: NO_LABELS,
};

export class Engine {
  readonly #settings = { ...INITIAL_SETTINGS };
  readonly #access: Access;
  readonly #claims: ClaimController;
  readonly #avatars = new AvatarModels();
  readonly #labels = new LabelLayout();
  /** Add this to a time of the page's clock for the time of this realm's. */
  readonly #clockShiftMs: number;
  #controller: StageController | null = null;
  #frameLoop: FrameLoop | null = null;
  #describeStage: typeof import("./stage-state").describeStage | null = null;
  /** Builds a mesh for the stage; null while its code is not loaded. */
  #prepareMesh: ((figure: Figure) => void) | null = null;
  #playback: Playback | null = null;
  #playbackNumber = 0;
  readonly #statisticsTimer: ReturnType<typeof setInterval>;
  #isClosed = false;
  /** True while an immersive session shows the stage: it requests the frames. */
  #isImmersive = false;
  #immersive: ImmersiveController | null = null;
  #lastState: StageState | null = null;
  /** State of the limbs that the page has; null if it has to render its own again. */
  #lastClaims: ClaimState | null = null;
  #lastPosition = NaN;

  /**
   * Call `start` once afterwards. Events are sent by `send`. `driver` is the name of the graphics driver, if it is
   * known already.
   */
  constructor(
    private readonly canvas: StageCanvas,
    private readonly options: EngineOptions,
    private readonly send: (event: EngineEvent) => void,
    private readonly driver?: string,
  ) {
    this.#clockShiftMs = options.timeOrigin - performance.timeOrigin;
    this.#access = new Access(options.server, options.token);
    if (options.view) this.#access.limitToViewing();
    this.#access.onUnauthorized(({ title, detail, hint }) => send({ type: "unauthorized", title, detail, hint }));
    this.#claims = new ClaimController(
      {
        render: (state) => this.#sendClaims(state),
        toast: (message, ask) => send({ type: "toast", message, ask: ask ?? null }),
        notice: (text) => send({ type: "limb notice", text }),
      },
      () => this.#settings.mapping,
    );
    this.#claims.viewOnly = !this.#access.allows("control");
    this.#statisticsTimer = setInterval(() => this.#sendStatistics(), STATISTICS_INTERVAL_MS);
  }

  /** Load the renderer and start drawing. Reports a stage that cannot be drawn. */
  async start(): Promise<void> {
    let graphics: Graphics;
    try {
      graphics = openGraphics(this.canvas, this.options.bestQuality, this.driver);
    } catch {
      this.send({ type: "unavailable", reason: "graphics" });
      return;
    }
    void this.#loadMesh(graphics.quality.quality.simpleMaterials ? "coarse" : "full");
    const chunk = await import("./stage-chunk").catch(() => null);
    if (!chunk) {
      this.send({ type: "unavailable", reason: "not loaded" });
      return;
    }
    this.send({ type: "loaded" });
    // Handle messages that arrived meanwhile first: the requests they lead to are sent before the stage is built.
    await new Promise((resolve) => setTimeout(resolve));
    if (this.#isClosed) return;
    this.#describeStage = chunk.describeStage;
    this.#build(
      new chunk.StageController(this.canvas, this.#claims, {
        getMapping: () => this.#settings.mapping,
        actions: createPageActions((action) => this.send({ type: "page action", action })),
        onClaimsChange: () => this.#claims.render(),
        graphics,
        isTransparent: this.options.view?.isTransparent ?? false,
        showsHandles: this.options.view === null,
        camera: this.options.view?.camera ?? null,
      }),
    );
    this.send({ type: "ready" });
    this.#frameLoop = new FrameLoop(
      () => this.#drawFrame(),
      () => this.#controller?.stage.isLate ?? false,
    );
  }

  /** Close the connections, stop drawing and free the graphics. */
  close(): void {
    this.#isClosed = true;
    clearInterval(this.#statisticsTimer);
    this.#frameLoop?.stop();
    this.#playback?.close();
    this.#controller?.stage.dispose();
    this.#playback = this.#controller = null;
  }

  /** Handle a message of the page. */
  handle(command: EngineCommand): void {
    const { commands, pointer, stage, velocity } = this.#controller ?? {};
    switch (command.type) {
      case "set":
        Object.assign(this.#settings, command.settings);
        this.#applySettings(command.settings);
        break;
      case "open":
        this.#open(command.playback);
        break;
      case "edit":
        this.#playback?.edit(command.change);
        break;
      case "seek":
        this.#playback?.seek(command.seconds, this.#toLocal(command.now));
        break;
      case "seek by blocks":
        this.#playback?.seekByBlocks(command.blocks, this.#toLocal(command.now));
        break;
      case "pointer":
        pointer?.handle({ ...command.event, now: this.#toLocal(command.event.now) });
        break;
      case "press":
        commands?.press(command.control, command.commands, command.strength, this.#toLocal(command.now));
        break;
      case "repeat":
        commands?.repeat(command.control);
        break;
      case "release":
        commands?.release(command.control, this.#toLocal(command.now));
        break;
      case "release all":
        commands?.releaseAll((control) => command.controls.includes(control));
        // A page in the background draws no frames, so nothing else would release the inputs that were pressed.
        if (this.#settings.isHidden) velocity?.update(performance.now());
        break;
      case "body":
        void this.#controller?.moveHands(command.hands, this.#toLocal(command.now));
        break;
      case "release limbs":
        velocity?.releaseAll();
        void this.#controller?.moveHands(null, 0);
        break;
      case "limb":
        this.#onLimbAction(command.action, command.limb);
        break;
      case "performer":
        if (command.performer === "next") this.#claims.selectNextPerformer();
        else this.#claims.selectedPerformer.select(command.performer);
        break;
      case "toggle camera":
        stage?.followMotionCamera(!stage.followsMotionCamera);
        break;
      case "avatar active":
        this.#avatars.setActive(command.performer, command.active);
        break;
      case "remove avatar":
        this.#avatars.remove(command.performer);
        break;
      case "lead":
        this.#setLead(command.lead);
        break;
      case "immersive":
        void this.#onImmersive(command.hands);
        break;
      case "request":
        void this.#respond(command.id, command.request);
        break;
    }
  }

  /** Load the code of the puppet's mesh, which is smaller than the renderer's. If that fails, the stage fails too. */
  async #loadMesh(detail: Detail): Promise<void> {
    const mesh = await import("../stage/puppet/puppet-geometry").catch(() => null);
    this.#prepareMesh = (figure) => mesh?.preparePuppetGeometry(figure, detail);
    if (!this.#controller) this.#updatePerformers();
  }

  /** Show the performers of the playback. While the renderer loads, build the mesh of the first. */
  #updatePerformers(): void {
    const figure = this.#playback?.viewer.figure;
    if (this.#controller) this.#controller.updatePerformers();
    else if (figure) this.#prepareMesh?.(figure);
  }

  #build(controller: StageController): void {
    const { canvas } = this;
    this.#controller = controller;
    canvas.addEventListener("webglcontextlost", () => this.send({ type: "graphics", isLost: true }));
    canvas.addEventListener("webglcontextrestored", () => this.send({ type: "graphics", isLost: false }));
    this.#avatars.stage = controller.stage;
    this.#applySettings(this.#settings);
    controller.setPlayback(this.#playback);
    this.#exposeDebugHandle();
  }

  #applySettings({ theme, reducedMotion, mapping, viewport, labels }: Partial<EngineSettings>): void {
    if (mapping) {
      // The page shows the keys of the limbs.
      this.#lastClaims = null;
      this.#claims.render();
    }
    if (labels) this.#labels.metrics = labels;
    const stage = this.#controller?.stage;
    if (!stage) return;
    if (theme) stage.setTheme(theme);
    if (reducedMotion !== undefined) stage.reducedMotion = reducedMotion;
    if (!viewport) return;
    const { width, height, framing, pixelRatio, sideInsets, bottomInset } = viewport;
    stage.resize(width, height, framing, pixelRatio, sideInsets, bottomInset);
  }

  /** Enter a session or motion, and leave the current one. */
  #open({ number, id, kind, name }: PlaybackRequest): void {
    this.#playback?.close();
    const playback = new Playback(id, name, (error) => this.#onEditError(error), {
      kind,
      access: this.#access,
      isHidden: () => this.#settings.isHidden,
    });
    [this.#playback, this.#playbackNumber] = [playback, number];
    this.#controller?.stage.cameraRecorder.clear();
    this.#claims.connected = false;
    this.#claims.setPlayback(playback);
    this.#controller?.setPlayback(playback);
    const { viewer } = playback;
    const setConnected = (connected: boolean) => {
      this.#claims.connected = connected;
      this.#claims.render();
    };
    viewer.addEventListener("open", () => setConnected(true));
    viewer.addEventListener("closed", () => setConnected(false));
    for (const event of ["figure", "tracks"]) viewer.addEventListener(event, () => this.#updatePerformers());
    publishPlayback(playback, (change) => {
      if (number === this.#playbackNumber) this.send({ type: "playback", playback: number, change });
    });
    this.#claims.render();
    this.#exposeDebugHandle();
  }

  #onEditError(error: unknown): void {
    const problem = error instanceof ProblemError ? { title: error.title, detail: error.detail } : null;
    this.send({ type: "edit failed", message: String(error), problem });
  }

  #onLimbAction(action: LimbAction, limb: number | null): void {
    if (action === "ask") this.#claims.requestLimb(limb ?? undefined);
    else if (action === "give") this.#claims.handOver(limb ?? undefined);
    else if (action === "join") this.#claims.joinHands();
    else if (limb === null) return;
    else if (action === "toggle") this.#claims.toggleClaim(limb);
    else if (action === "withdraw") this.#claims.withdrawRequest(limb);
    else this.#controller?.velocity.hold(limb);
  }

  #setLead(lead: Extract<EngineCommand, { type: "lead" }>["lead"]): void {
    const viewer = this.#playback?.viewer;
    if (!viewer) return;
    const at = lead && this.#toLocal(lead.at);
    viewer.leader = lead && at !== null ? (now) => ({ time: lead.time + (now - at) * 1000, run: lead.run }) : null;
  }

  #drawFrame(): void {
    const controller = this.#controller;
    if (!controller || !this.#describeStage || this.#isImmersive) return;
    const now = performance.now();
    const frame = controller.draw(now, this.#settings.focusedLimb);
    // What lies over the stage moves with what the canvas shows.
    if (controller.stage.isUpToDate) this.#sendFrame(this.#describeStage(controller, frame, this.#labels, now), now);
    this.#playback?.viewer.recordFrame(performance.now() - now);
  }

  /** Send the next frame of an immersive session with these hands; null ends it. */
  async #onImmersive(hands: readonly HandState[] | null): Promise<void> {
    this.#isImmersive = hands !== null;
    // The session asks again for a frame that was not sent.
    const chunk = await import("./immersive-controller").catch(() => null);
    if (!chunk || !this.#controller) return;
    this.#immersive ??= new chunk.ImmersiveController(this.#controller, this.#claims, this.#settings);
    const frame = this.#immersive.advance(performance.now(), hands);
    if (frame) this.send({ type: "immersive", frame });
  }

  /** Send the state of the limbs if it has changed: several events lead to the same one. */
  #sendClaims(state: ClaimState): void {
    if (changedParts(this.#lastClaims, state)) this.send({ type: "limbs", state });
    this.#lastClaims = state;
  }

  /** Send what has changed since the last frame. */
  #sendFrame(state: StageState, now: number): void {
    const changes = changedParts(this.#lastState, state);
    const time = this.#viewerTime(now);
    const position = time?.position ?? NaN;
    if (changes || !Object.is(position, this.#lastPosition))
      this.send({ type: "frame", changes, playback: this.#playbackNumber, time });
    [this.#lastState, this.#lastPosition] = [state, position];
  }

  /** Return the viewer's time at local `now`; null before the server has sent its own. */
  #viewerTime(now: number): ViewerTime | null {
    const playback = this.#playback;
    if (!playback?.viewer.clock.hasEstimate) return null;
    return {
      now: now - this.#clockShiftMs,
      position: playback.position(now),
      ownTime: playback.viewer.ownTime(now),
      isClockSettled: playback.viewer.clock.isSettled,
    };
  }

  #sendStatistics(): void {
    const playback = this.#playback;
    if (!playback) return;
    this.send({
      type: "statistics",
      playback: this.#playbackNumber,
      statistics: playback.viewer.statistics(),
      isConnected: this.#claims.connected,
      time: this.#viewerTime(performance.now()),
    });
  }

  async #respond(id: number, request: EngineRequest): Promise<void> {
    try {
      this.send({ type: "response", id, result: await this.#fulfil(request) });
    } catch (error) {
      this.send({ type: "response", id, failure: describeFailure(error) });
    }
  }

  async #fulfil(request: EngineRequest): Promise<EngineResults[EngineRequest["kind"]]> {
    const stage = this.#controller?.stage;
    switch (request.kind) {
      case "picture":
        if (!stage) throw new Error("There is no stage to draw a picture of.");
        return stage.takePicture();
      case "load avatar":
        return this.#avatars.load(request.performer, request.file);
      case "camera keyframes": {
        const viewer = this.#playback?.viewer;
        const clock = viewer?.clockTime(performance.now()) ?? null;
        return viewer && clock !== null
          ? (stage?.cameraRecorder.movedKeyframes(clock - viewer.duration * 1e6) ?? [])
          : [];
      }
      case "put prop": {
        const { putProp } = await import("./prop-request");
        const playback = this.#playback;
        return playback && putProp(playback, stage?.performers ?? [], request.prop, request.limb);
      }
      case "move prop": {
        const { moveNearestProp } = await import("./prop-request");
        const { hands, stage: { performers } = { performers: [] } } = this.#controller ?? {};
        return moveNearestProp(this.#playback, performers, (limb) => Boolean(hands?.source(limb)));
      }
    }
  }

  #toLocal(pageMs: number): number {
    return pageMs + this.#clockShiftMs;
  }

  /** Set `bunraku` in this realm, the parts of the engine, for tests and for developers. */
  #exposeDebugHandle(): void {
    const { stage = null, hands = null } = this.#controller ?? {};
    const { viewer = null, puppeteer = null } = this.#playback ?? {};
    const global = globalThis as { bunraku?: object };
    global.bunraku = { ...global.bunraku, stage, hands, viewer, puppeteer };
  }
}

function describeFailure(error: unknown): EngineFailure {
  const known = error instanceof AvatarError ? { title: error.title, detail: error.detail, hint: error.hint } : null;
  return { known, message: String(error) };
}
