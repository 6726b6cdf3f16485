/** One stage at work: from when its element comes into a document until it has left it. The element's wiring. */
import { Access, tabToken } from "../client/access";
import { ProblemError } from "../client/problem";
import { whyUnreached } from "../client/reach";
import { Holding } from "../holding";
import { loadMapping } from "../input/mapping-store";
import { ownName } from "../page/name";
import type { Performing } from "../performing";
import { findSession, Room } from "../room";
import type { Theme } from "../stage/look";
import { createFace, type Face } from "./face";
import { readSource, type Source } from "./source";

/** What its element is told: the name of an event, and its detail. */
export type Tell = (event: "ready" | "welcome" | "presence" | "closed" | "error", detail?: unknown) => void;

/** Narrower than this share of its height, a picture is framed as a phone's. */
const PORTRAIT = 0.7;

export class Showing {
  room: Room | null = null;
  performing: Performing | null = null;
  readonly #face: Face;
  readonly #holding: Holding;
  readonly #observers: { disconnect(): void }[] = [];
  #theme: Theme = "night";
  #still = false;
  #controls = false;
  #focused: number | null = null;
  #inSight = true;
  #ready = false;
  #closed = false;
  #frame = 0;
  /** Counts what was asked for: what comes too late is not shown. */
  #asked = 0;

  constructor(private readonly root: ShadowRoot, private readonly tell: Tell) {
    this.#face = createFace(root, {
      play: () => this.play(!this.playing),
      toggle: (limb) => this.#holding.toggle(limb),
      focus: (limb) => (this.#focused = limb),
      ask: (limb) => this.#holding.ask(limb),
      give: (limb) => this.#holding.give(limb),
    });
    const { toast, asks } = this.#face;
    const mapping = loadMapping();
    this.#holding = new Holding({
      asks,
      toast,
      strings: { render: (limbs, ready) => this.#face.limbs(limbs, this.#hands, ready), notice: (text) => toast(text) },
    }, () => mapping);
    this.#holding.watching = true;
    void this.#open();
  }

  get playing(): boolean {
    return this.room?.viewer.timeline?.playing ?? false;
  }

  /** Plays or pauses: a session for everyone, where that is allowed. */
  play(playing: boolean): void {
    this.room?.edit({ playing });
  }

  seek(seconds: number): void {
    this.room?.seek(seconds, performance.now());
  }

  set theme(theme: Theme) {
    this.#theme = theme;
    this.performing?.stage.setTheme(theme);
  }

  set still(still: boolean) {
    this.#still = still;
    if (this.performing) this.performing.stage.still = still;
  }

  /** Shows what `src` names (null: nothing), with controls or only to be watched. */
  async show(src: string | null, controls: boolean): Promise<void> {
    const asked = ++this.#asked;
    this.#controls = controls;
    this.#leave();
    this.#resize();
    this.#face.notice(null);
    if (src === null) return;
    const source = readSource(src, document.baseURI);
    if (!source) return this.#fail("No stage is here", `${JSON.stringify(src)} is no address of a stage.`);
    const own = source.server === location.origin ? tabToken() : null;
    const access = new Access(source.server, source.token ?? own);
    try {
      const id = source.id ?? (await findSession(Promise.resolve(null), access))?.id ?? null;
      if (asked !== this.#asked || this.#closed) return;
      if (id === null) this.#fail("The stage is empty", "Nobody dances here now. Come again when somebody does.");
      else this.#enter(source, id, access);
    } catch (error) {
      if (asked !== this.#asked || this.#closed) return;
      if (!(error instanceof ProblemError)) throw error;
      if (error.status === 0) await this.#unreached(source.server, asked, error);
      else this.#problem(error);
    }
  }

  /** Ends it for good: its sockets, its listening and its graphics. */
  close(): void {
    this.#closed = true;
    cancelAnimationFrame(this.#frame);
    for (const observer of this.#observers) observer.disconnect();
    document.removeEventListener("visibilitychange", this.#hidden);
    this.#leave();
    this.performing?.stage.dispose();
    this.performing = null;
    this.#face.remove();
  }

  /** Whether limbs can be taken from here. */
  get #hands(): boolean {
    return this.#controls && this.room?.place === "sessions" && this.room.access.may("control");
  }

  #enter({ place, query, server }: Source, id: string, access: Access): void {
    const asked = this.#asked;
    const failed = (error: unknown) => this.#face.toast(error instanceof ProblemError ? `${error.title}: ${error.detail}` : String(error));
    const room = new Room(id, ownName(query, Math.random()), failed, { place, access, watching: !this.#controls });
    this.room = room;
    const { viewer, puppeteer } = room;
    let denied = false;
    let opened = false;
    access.whenDenied((problem) => {
      denied = true;
      this.#problem(problem);
    });
    this.#holding.watching = !this.#hands;
    this.#holding.enter(room);
    this.performing?.enter(room);
    (this.root.host as HTMLElement).toggleAttribute("data-hands", this.#hands);
    const during = (target: EventTarget, event: string, then: (event: Event) => void) =>
      target.addEventListener(event, (told) => {
        if (this.room === room) then(told);
      });
    during(viewer, "figure", () => this.performing?.cast());
    during(viewer, "timeline", () => this.#bar());
    during(viewer, "presence", () => this.tell("presence", viewer.presence));
    during(puppeteer, "welcome", () => this.tell("welcome", { id: puppeteer.id, colour: puppeteer.colour }));
    during(viewer, "open", () => {
      // asked for less motion, a dance of one's own waits
      if (this.#still && !opened && place === "motions") room.edit({ playing: false });
      opened = true;
      this.#holding.connected = true;
      this.#holding.render();
      this.#face.notice(null);
    });
    during(viewer, "closed", (event) => {
      const reason = String((event as CustomEvent<string>).detail);
      this.#holding.connected = false;
      this.#holding.render();
      this.tell("closed", { reason, final: viewer.ended });
      if (denied) return;
      if (viewer.ended) this.#face.notice(place === "motions" ? "The dance has ended" : "The session has ended", reason);
      else if (!opened) void this.#unreached(server, asked, ProblemError.unreachable());
      else this.#face.toast(`The line was lost: ${reason}`);
    });
    this.#bar();
    this.#holding.render();
  }

  #leave(): void {
    const { room } = this;
    this.room = null;
    this.#ready = false;
    this.#holding.connected = false;
    room?.close();
    (this.root.host as HTMLElement).removeAttribute("data-hands");
    this.#face.bar(false, null);
  }

  /** Says why no word comes from a server, and gives up where it will not. */
  async #unreached(server: string, asked: number, problem: ProblemError): Promise<void> {
    const why = await whyUnreached(server, location.origin);
    if (asked !== this.#asked || this.#closed || this.#holding.connected) return;
    if (why?.final) this.#leave();
    if (why) this.#fail(why.title, why.text);
    else if (!this.room) this.#problem(problem);
  }

  #problem({ title, detail, hint }: ProblemError): void {
    this.#fail(title, hint ? `${detail}; ${hint}.` : detail);
  }

  #fail(title: string, text: string): void {
    this.#face.notice(title, text);
    this.tell("error", `${title}: ${text}`);
  }

  #bar(): void {
    const { room } = this;
    const editable = room?.editable ?? false;
    this.#face.bar(this.#controls && room !== null && (editable || this.#hands), editable ? this.playing : null);
  }

  async #open(): Promise<void> {
    const theatre = await import("../theatre").catch(() => null);
    if (this.#closed) return;
    if (!theatre) return this.#fail("The stage does not answer", "What draws it could not be loaded. Load this page again.");
    const { listenToKeyboard, listenToMouse, Performing } = theatre;
    const { canvas, frame } = this.#face;
    const nothing = () => undefined;
    const mapping = loadMapping();
    const actions = {
      ask: () => this.#holding.ask(), give: () => this.#holding.give(), play: () => this.play(!this.playing),
      back: () => this.#step(-1), forward: () => this.#step(1),
      camera: () => this.performing?.stage.follow(!this.performing.stage.following),
      sound: nothing, keep: nothing, library: nothing, strings: nothing, line: nothing,
    };
    try {
      this.performing = new Performing(canvas, this.#holding, { mapping: () => mapping, actions, changed: () => this.#holding.render() });
    } catch {
      return this.#fail("This browser cannot draw the stage", "It needs WebGL 2. Try another browser, or switch on hardware acceleration.");
    }
    const { stage, commands, velocity } = this.performing;
    stage.still = this.#still;
    stage.setTheme(this.#theme);
    listenToKeyboard(frame, commands, velocity, () => (this.#controls ? mapping : { ...mapping, bindings: {} }), { keys: nothing, escape: nothing });
    listenToMouse(canvas, frame, commands, () => mapping);
    // a finger on a ring pulls it; elsewhere it turns over the page
    canvas.addEventListener("touchstart", (event) => "pulling" in canvas.dataset && event.preventDefault(), { passive: false });
    document.addEventListener("visibilitychange", this.#hidden);
    const sizes = new ResizeObserver(() => this.#resize());
    sizes.observe(frame);
    const sight = new IntersectionObserver((entries) => (this.#inSight = entries.at(-1)?.isIntersecting ?? true));
    sight.observe(frame);
    this.#observers.push(sizes, sight);
    this.#resize();
    if (this.room) this.performing.enter(this.room);
    this.#frame = requestAnimationFrame(() => this.#draw());
  }

  readonly #hidden = () => {
    if (document.hidden) this.performing?.rest();
  };

  #resize(): void {
    const { clientWidth: width, clientHeight: height } = this.#face.frame;
    if (width === 0 || height === 0) return;
    // the bar stands where the page's does
    const framing = width < PORTRAIT * height ? "phone" : this.#controls ? "desktop" : "alone";
    this.performing?.stage.resize(width, height, framing, devicePixelRatio);
  }

  #step(blocks: number): void {
    const { viewer } = this.room ?? {};
    if (!this.room || !viewer || viewer.blocks.length === 0) return;
    const block = viewer.duration / viewer.blocks.length;
    this.seek(Math.min(viewer.duration, Math.max(0, this.room.position(performance.now()) + blocks * block)));
  }

  #draw(): void {
    this.#frame = requestAnimationFrame(() => this.#draw());
    const { performing } = this;
    if (!performing || !this.#inSight) return;
    const now = performance.now();
    const { pose, limbs } = performing.draw(now, this.#focused);
    const { stage } = performing;
    this.#face.tags.render(limbs, pose ? limbs.map((_, limb) => stage.bar(limb)) : [], stage.face);
    this.room?.viewer.drawn(performance.now() - now);
    if (pose && !this.#ready) {
      this.#ready = true;
      this.tell("ready");
    }
  }
}
