/** `<bunraku-stage src="https://stage.example/?session=ID">`: a stage as an element of any page. */
import type { Puppeteer } from "../client/puppeteer";
import type { Viewer } from "../client/viewer";
import type { Presence } from "../page/model";
import type { Stage } from "../stage/stage";
import { Showing } from "./showing";

/** Night or day, or as the system wishes. */
export type ThemeWish = "night" | "day" | "auto";

/** What its listeners are told, by the name of the event. */
export interface BunrakuStageEvents {
  /** The first pose is on the stage. */
  ready: CustomEvent<void>;
  /** The session takes this page for a puppeteer; again each time the line comes back. */
  welcome: CustomEvent<{ id: string; colour: number }>;
  /** Who is here and who holds what. */
  presence: CustomEvent<Presence>;
  /** The line is gone; unless `final`, it comes back by itself. */
  closed: CustomEvent<{ reason: string; final: boolean }>;
  /** What is in the way, in plain words, which the element shows too. */
  error: CustomEvent<string>;
}

const Base: typeof HTMLElement = typeof HTMLElement === "undefined" ? (class {} as typeof HTMLElement) : HTMLElement;

/**
 * Attributes, each of which may change at any time: `src` (a page, session or motion of a server, with `#share=...` where it asks for a link), `theme`
 * (`night`, `day`, or `auto`), `controls` (limbs can be taken, and the dance paused; else it is only watched), `still` (less motion; `prefers-reduced-motion` does the same).
 */
export class BunrakuStage extends Base {
  static readonly observedAttributes = ["src", "theme", "controls", "still"] as const;

  #showing: Showing | null = null;
  readonly #day = globalThis.matchMedia?.("(prefers-color-scheme: light)");
  readonly #calm = globalThis.matchMedia?.("(prefers-reduced-motion: reduce)");
  readonly #dress = () => this.#dressed();
  #waiting = false;

  /** The address of what is shown, as the attribute has it. */
  get src(): string {
    return this.getAttribute("src") ?? "";
  }

  set src(src: string) {
    this.setAttribute("src", src);
  }

  get theme(): ThemeWish {
    const theme = this.getAttribute("theme");
    return theme === "night" || theme === "day" ? theme : "auto";
  }

  set theme(theme: ThemeWish) {
    this.setAttribute("theme", theme);
  }

  get controls(): boolean {
    return this.hasAttribute("controls");
  }

  set controls(controls: boolean) {
    this.toggleAttribute("controls", controls);
  }

  get still(): boolean {
    return this.hasAttribute("still");
  }

  set still(still: boolean) {
    this.toggleAttribute("still", still);
  }

  /** What comes over the line; null while there is none. It changes with `src`. */
  get viewer(): Viewer | null {
    return this.#showing?.room?.viewer ?? null;
  }

  /** One's own hands; null while there is no line. */
  get puppeteer(): Puppeteer | null {
    return this.#showing?.room?.puppeteer ?? null;
  }

  /** What draws; null before it is there, and where the browser cannot. */
  get stage(): Stage | null {
    return this.#showing?.performing?.stage ?? null;
  }

  get playing(): boolean {
    return this.#showing?.playing ?? false;
  }

  /** Seconds in the dance. */
  get position(): number {
    return this.#showing?.room?.position(performance.now()) ?? 0;
  }

  /** Seconds; 0 before it is known. */
  get duration(): number {
    return this.viewer?.duration ?? 0;
  }

  /** Plays; a session for everyone who watches it, where the link allows that. */
  play(): void {
    this.#showing?.play(true);
  }

  /** Pauses, likewise. */
  pause(): void {
    this.#showing?.play(false);
  }

  /** Goes to a time of the dance, in seconds; likewise. */
  seek(seconds: number): void {
    this.#showing?.seek(seconds);
  }

  connectedCallback(): void {
    // moved within the document, it goes on
    if (this.#showing) return;
    const root = this.shadowRoot ?? this.attachShadow({ mode: "open" });
    this.#showing = new Showing(root, (event, detail) => this.dispatchEvent(new CustomEvent(event, { detail })));
    this.#day.addEventListener("change", this.#dress);
    this.#calm.addEventListener("change", this.#dress);
    this.#dressed();
    this.#show();
  }

  disconnectedCallback(): void {
    queueMicrotask(() => {
      if (!this.isConnected) this.#end();
    });
  }

  /** Moved by `moveBefore`: nothing is to be done. */
  connectedMoveCallback(): void {}

  attributeChangedCallback(name: (typeof BunrakuStage.observedAttributes)[number], before: string | null, now: string | null): void {
    if (!this.#showing || before === now) return;
    if (name === "theme" || name === "still") this.#dressed();
    else if (name === "src" || (before === null) !== (now === null)) this.#show();
  }

  #end(): void {
    this.#showing?.close();
    this.#showing = null;
    this.#day.removeEventListener("change", this.#dress);
    this.#calm.removeEventListener("change", this.#dress);
  }

  /** Once for several attributes that change together. */
  #show(): void {
    if (this.#waiting) return;
    this.#waiting = true;
    queueMicrotask(() => {
      this.#waiting = false;
      void this.#showing?.show(this.getAttribute("src"), this.controls);
    });
  }

  #dressed(): void {
    const { theme } = this;
    const shown = theme === "auto" ? (this.#day.matches ? "day" : "night") : theme;
    this.setAttribute("data-shown", shown);
    if (!this.#showing) return;
    this.#showing.theme = shown;
    this.#showing.still = this.still || this.#calm.matches;
  }
}

export interface BunrakuStage {
  addEventListener<K extends keyof BunrakuStageEvents>(type: K, listener: (this: BunrakuStage, event: BunrakuStageEvents[K]) => void, options?: boolean | AddEventListenerOptions): void;
  addEventListener(type: string, listener: EventListenerOrEventListenerObject, options?: boolean | AddEventListenerOptions): void;
}

declare global {
  interface HTMLElementTagNameMap {
    "bunraku-stage": BunrakuStage;
  }
}
