/** `<bunraku-stage src="https://stage.example/?session=ID">`: a stage as an element of any page. */
import type { SoundPreference } from "../audio/preference";
import type { Puppeteer } from "../client/puppeteer";
import type { Viewer } from "../client/viewer";
import { loadJapaneseTranslator } from "../i18n/language";
import { type Language, Translator } from "../i18n/translator";
import type { Stage } from "../stage/stage";
import type { Presence } from "../ui/limb-state";
import { ElementController } from "./controller";

/** Theme of the element; `auto` follows the system's preference. */
export type ThemePreference = "night" | "day" | "auto";

/** Events of the element. */
export interface BunrakuStageEvents {
  /** The first pose was drawn. */
  ready: CustomEvent<void>;
  /** The session accepted this page as a puppeteer. Sent again after each reconnection. */
  welcome: CustomEvent<{ id: string; colour: number }>;
  /** Viewers, puppeteers and holders of limbs changed. */
  presence: CustomEvent<Presence>;
  /** The connection was closed; unless `final`, it is restored automatically. */
  closed: CustomEvent<{ reason: string; final: boolean }>;
  /** Text of an error that the element shows. */
  error: CustomEvent<string>;
  /** `muted` or `volume` changed. */
  volumechange: Event;
}

const ElementBase: typeof HTMLElement =
  typeof HTMLElement === "undefined" ? (class {} as typeof HTMLElement) : HTMLElement;

/**
 * Custom element that shows a stage. Its attributes may change at any time:
 *
 * - `src`: address of a page, session or motion of a server, with `#share=...` if the server requires a link.
 * - `theme`: `night`, `day` or `auto`.
 * - `controls`: limbs can be claimed and the motion can be paused; otherwise viewing only.
 * - `still`: less motion, as with `prefers-reduced-motion`.
 * - `muted`: setting or removing it switches the sound off or on. The element is muted at first in any case.
 * - `volume`: 0 to 1.
 * - `lang`: Japanese for `ja`, else English; inherited from the nearest ancestor.
 */
// biome-ignore lint/suspicious/noUnsafeDeclarationMerging: the interface below only adds types to addEventListener
export class BunrakuStage extends ElementBase {
  static readonly observedAttributes = ["src", "theme", "controls", "still", "muted", "volume", "lang"] as const;

  #controller: ElementController | null = null;
  /** Current language, or the one that is being loaded; null while the element is in no document. */
  #language: Language | null = null;
  /** Number of starts and stops, to discard translations that were loaded for an earlier one. */
  #startCount = 0;
  readonly #lightScheme = globalThis.matchMedia?.("(prefers-color-scheme: light)");
  readonly #reducedMotion = globalThis.matchMedia?.("(prefers-reduced-motion: reduce)");
  readonly #onAppearanceChange = () => this.#applyAppearance();
  #languageObserver: MutationObserver | null = null;
  #showQueued = false;
  #muted = true;

  /** Value of the attribute `src`. */
  get src(): string {
    return this.getAttribute("src") ?? "";
  }

  set src(src: string) {
    this.setAttribute("src", src);
  }

  get theme(): ThemePreference {
    const theme = this.getAttribute("theme");
    return theme === "night" || theme === "day" ? theme : "auto";
  }

  set theme(theme: ThemePreference) {
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

  /**
   * Whether the sound is off, as it is at first. Browsers only allow sound after a gesture of the user: set this to
   * false in a handler of one, or it takes effect at the next gesture anywhere in the page.
   */
  get muted(): boolean {
    return this.#muted;
  }

  set muted(muted: boolean) {
    if (muted === this.#muted) return;
    this.#muted = muted;
    this.#applySoundPreference();
  }

  /** Volume, 0 to 1; 1 by default. Setting any other number throws `IndexSizeError`, as `<video>` does. */
  get volume(): number {
    return parseVolume(this.getAttribute("volume"));
  }

  set volume(volume: number) {
    if (!(volume >= 0 && volume <= 1))
      throw new DOMException(`The volume ${volume} is outside the range 0 to 1.`, "IndexSizeError");
    this.setAttribute("volume", String(volume));
  }

  /** Viewer of the current session or motion, replaced when `src` changes; null while there is none. */
  get viewer(): Viewer | null {
    return this.#controller?.playback?.viewer ?? null;
  }

  /** Puppeteer of this page; null while there is no session or motion. */
  get puppeteer(): Puppeteer | null {
    return this.#controller?.playback?.puppeteer ?? null;
  }

  /** Renderer; null until it was loaded, and if the browser has no WebGL 2. */
  get stage(): Stage | null {
    return this.#controller?.renderer.stageController?.stage ?? null;
  }

  get playing(): boolean {
    return this.#controller?.playing ?? false;
  }

  /** Position in the motion, in seconds. */
  get position(): number {
    return this.#controller?.playback?.position(performance.now()) ?? 0;
  }

  /** Duration of the motion in seconds; 0 until it is known. */
  get duration(): number {
    return this.viewer?.duration ?? 0;
  }

  /** Play; a session for all its viewers, if the link allows that. */
  play(): void {
    this.#controller?.setPlaying(true);
  }

  /** Pause; a session for all its viewers, if the link allows that. */
  pause(): void {
    this.#controller?.setPlaying(false);
  }

  /** Seek to a time in seconds; a session for all its viewers, if the link allows that. */
  seek(seconds: number): void {
    this.#controller?.seek(seconds);
  }

  connectedCallback(): void {
    // The language of an ancestor may change.
    this.#languageObserver ??= new MutationObserver(() => void this.#start());
    this.#languageObserver.observe(document, { subtree: true, attributeFilter: ["lang"] });
    void this.#start();
  }

  disconnectedCallback(): void {
    queueMicrotask(() => {
      if (this.isConnected) return;
      this.#languageObserver?.disconnect();
      this.#stop();
    });
  }

  /**
   * Handle a move by `moveBefore`: its presence keeps the browser from calling disconnected and connected callbacks.
   */
  connectedMoveCallback(): void {}

  attributeChangedCallback(
    name: (typeof BunrakuStage.observedAttributes)[number],
    before: string | null,
    after: string | null,
  ): void {
    if (name === "lang") {
      if (this.#language) void this.#start();
      return;
    }
    if (name === "muted") {
      this.muted = after !== null;
      return;
    }
    if (name === "volume") {
      if (parseVolume(before) !== parseVolume(after)) this.#applySoundPreference();
      return;
    }
    if (!this.#controller || before === after) return;
    if (name === "theme" || name === "still") this.#applyAppearance();
    else if (name === "src" || (before === null) !== (after === null)) this.#scheduleShow();
  }

  /** Start in the language of the element's position in the document, or continue if that language is used already. */
  async #start(): Promise<void> {
    // `:lang()` uses the nearest `lang` attribute, else the document's Content-Language.
    const language = this.matches(":lang(ja)") ? "ja" : "en";
    if (language === this.#language) return;
    this.#stop();
    this.#language = language;
    const start = this.#startCount;
    const translator = language === "ja" ? await loadJapaneseTranslator() : new Translator();
    if (start !== this.#startCount) return;
    const root = this.shadowRoot ?? this.attachShadow({ mode: "open" });
    const soundPreference = {
      load: () => ({ on: !this.#muted, volume: this.volume }),
      save: ({ on }: SoundPreference) => void (this.muted = !on),
    };
    this.#controller = new ElementController(root, translator, soundPreference, (event, detail) =>
      this.dispatchEvent(new CustomEvent(event, { detail })),
    );
    this.#lightScheme.addEventListener("change", this.#onAppearanceChange);
    this.#reducedMotion.addEventListener("change", this.#onAppearanceChange);
    this.#applyAppearance();
    this.#scheduleShow();
  }

  #stop(): void {
    this.#startCount++;
    this.#language = null;
    this.#controller?.close();
    this.#controller = null;
    this.#lightScheme.removeEventListener("change", this.#onAppearanceChange);
    this.#reducedMotion.removeEventListener("change", this.#onAppearanceChange);
  }

  #applySoundPreference(): void {
    this.#controller?.soundController.setPreference({ on: !this.#muted, volume: this.volume });
    // Initial values are no change.
    if (this.#language) this.dispatchEvent(new Event("volumechange"));
  }

  /** Show the stage anew, once for several attributes that change together. */
  #scheduleShow(): void {
    if (this.#showQueued) return;
    this.#showQueued = true;
    queueMicrotask(() => {
      this.#showQueued = false;
      void this.#controller?.show(this.getAttribute("src"), this.controls);
    });
  }

  #applyAppearance(): void {
    const { theme } = this;
    const shown = theme === "auto" ? (this.#lightScheme.matches ? "day" : "night") : theme;
    this.setAttribute("data-shown", shown);
    if (!this.#controller) return;
    this.#controller.renderer.theme = shown;
    this.#controller.renderer.still = this.still || this.#reducedMotion.matches;
  }
}

/** Parse the attribute `volume`; 1 if it is absent or invalid. */
function parseVolume(attribute: string | null): number {
  const volume = parseFloat(attribute ?? "");
  return volume >= 0 && volume <= 1 ? volume : 1;
}

export interface BunrakuStage {
  addEventListener<K extends keyof BunrakuStageEvents>(
    type: K,
    listener: (this: BunrakuStage, event: BunrakuStageEvents[K]) => void,
    options?: boolean | AddEventListenerOptions,
  ): void;
  addEventListener(
    type: string,
    listener: EventListenerOrEventListenerObject,
    options?: boolean | AddEventListenerOptions,
  ): void;
}

declare global {
  interface HTMLElementTagNameMap {
    "bunraku-stage": BunrakuStage;
  }
}
