/** The picture of a showing: what its room shows, drawn in the size of its element while that is in sight. */
import type { Holding } from "../holding";
import type { PageActions } from "../input/commands";
import { ACTIONS, type Mapping } from "../input/mapping";
import { loadMapping } from "../input/mapping-store";
import type { Performing } from "../performing";
import type { Room } from "../room";
import type { Theme } from "../stage/look";
import type { Face } from "./face";

/** Narrower than this share of its height, a picture is framed as a phone's. */
const PORTRAIT = 0.7;
/** In a picture lower than this the bar stands at its side, pixels (`element.css`). */
const LOW = 380;

/** What keys do beside taking limbs; what else they do is the page's. */
export type Deeds = Pick<PageActions, "next_dancer" | "ask" | "give" | "play" | "back" | "forward" | "sound">;

export class Drawing {
  performing: Performing | null = null;
  /** The limb whose button has the focus. */
  focused: number | null = null;
  /** Told of the first pose of a room. */
  begun: () => void = () => undefined;
  readonly mapping: Mapping = loadMapping();
  #room: Room | null = null;
  #theme: Theme = "night";
  #still = false;
  #controls = false;
  #inSight = true;
  #told = false;
  #closed = false;
  #frame = 0;
  readonly #observers: { disconnect(): void }[] = [];

  constructor(private readonly face: Face, private readonly holding: Holding) {}

  set theme(theme: Theme) {
    this.#theme = theme;
    this.performing?.stage.setTheme(theme);
  }

  set still(still: boolean) {
    this.#still = still;
    if (this.performing) this.performing.stage.still = still;
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
  enter(room: Room | null): void {
    this.#room = room;
    this.#told = false;
    this.performing?.enter(room);
  }

  /** Loads what draws and begins; what is in the way where that cannot be. */
  async open(deeds: Deeds): Promise<"not loaded" | "no graphics" | null> {
    const theatre = await import("../theatre").catch(() => null);
    if (this.#closed) return null;
    if (!theatre) return "not loaded";
    const { listenToKeyboard, listenToMouse, Performing } = theatre;
    const { canvas, frame } = this.face;
    const nothing = () => undefined;
    const idle = Object.fromEntries(ACTIONS.map((action) => [action, nothing])) as PageActions;
    const camera = () => this.performing?.stage.follow(!this.performing.stage.following);
    const actions: PageActions = { ...idle, camera, ...deeds };
    try {
      this.performing = new Performing(canvas, this.holding, { mapping: () => this.mapping, actions, changed: () => this.holding.render() });
    } catch {
      return "no graphics";
    }
    const { stage, commands, velocity } = this.performing;
    stage.still = this.#still;
    stage.setTheme(this.#theme);
    const keys = () => (this.#controls ? this.mapping : { ...this.mapping, bindings: {} });
    listenToKeyboard(frame, commands, velocity, keys, { keys: nothing, escape: nothing });
    listenToMouse(canvas, frame, commands, keys);
    // a finger on a ring pulls it; elsewhere it turns over the page
    canvas.addEventListener("touchstart", (event) => "pulling" in canvas.dataset && event.preventDefault(), { passive: false });
    document.addEventListener("visibilitychange", this.#hidden);
    const sizes = new ResizeObserver(() => this.#resize());
    const sight = new IntersectionObserver((entries) => (this.#inSight = entries.at(-1)?.isIntersecting ?? true));
    this.#observers.push(sizes, sight);
    for (const observer of [sizes, sight]) observer.observe(frame);
    this.#resize();
    if (this.#room) this.performing.enter(this.#room);
    this.#frame = requestAnimationFrame(() => this.#draw());
    return null;
  }

  /** Ends it for good, and gives the graphics back. */
  close(): void {
    this.#closed = true;
    cancelAnimationFrame(this.#frame);
    for (const observer of this.#observers) observer.disconnect();
    document.removeEventListener("visibilitychange", this.#hidden);
    this.performing?.stage.dispose();
    this.performing = null;
  }

  readonly #hidden = () => {
    if (document.hidden) this.performing?.rest();
  };

  #resize(): void {
    const { clientWidth: width, clientHeight: height } = this.face.frame;
    if (width === 0 || height === 0) return;
    // a bar below stands where the page's does
    const framing = width < PORTRAIT * height ? "phone" : this.#controls && height >= LOW ? "desktop" : "alone";
    this.performing?.stage.resize(width, height, framing, devicePixelRatio);
  }

  #draw(): void {
    this.#frame = requestAnimationFrame(() => this.#draw());
    const { performing } = this;
    if (!performing || !this.#inSight) return;
    const now = performance.now();
    const { pose, limbs } = performing.draw(now, this.focused);
    const { stage } = performing;
    this.face.tags.render(limbs, pose ? limbs.map((_, limb) => stage.bar(limb)) : [], stage.faces, now, this.holding.chosen.performer);
    this.#room?.viewer.drawn(performance.now() - now);
    if (!pose || this.#told) return;
    this.#told = true;
    this.begun();
  }
}
