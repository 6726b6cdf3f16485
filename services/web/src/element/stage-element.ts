/** `<bunraku-stage src="https://stage.example/?session=ID">`: a stage as an element of any page. */
import type { SoundPreference } from "../audio/preference";
import type { Puppeteer } from "../client/puppeteer";
import type { Viewer } from "../client/viewer";
import { loadJapaneseTranslator } from "../i18n/language";
import { type Language, Translator } from "../i18n/translator";
import type { Stage } from "../stage/stage";
import type { Presence } from "../ui/limb-state";
import { ElementController } from "./controller";

/** Night or day, or as the system wishes. */
export type ThemePreference = "night" | "day" | "auto";

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
  /** `muted` or `volume` is another, whoever changed it. */
  volumechange: Event;
}

const ElementBase: typeof HTMLElement =
  typeof HTMLElement === "undefined" ? (class {} as typeof HTMLElement) : HTMLElement;

/**
 * Attributes, each of which may change at any time: `src` (a page, session or motion of a server, with `#share=...` where it asks for a link), `theme`
 * (`night`, `day`, or `auto`), `controls` (limbs can be taken, and the dance paused; else it is only watched), `still` (less motion; `prefers-reduced-motion` does the same),
 * `muted` (put there or taken away it is followed; left out it is muted at first all the same), `volume`, and `lang`, its own or that of what it stands in: it speaks Japanese or English.
 */
export class BunrakuStage extends ElementBase {
  static readonly observedAttributes = ["src", "theme", "controls", "still", "muted", "volume", "lang"] as const;

  #controller: ElementController | null = null;
  /** What it speaks, or will once it has the words; null while it is in no document. */
  #language: Language | null = null;
  /** Counts its beginnings: words that come too late are not spoken. */
  #startCount = 0;
  readonly #lightScheme = globalThis.matchMedia?.("(prefers-color-scheme: light)");
  readonly #reducedMotion = globalThis.matchMedia?.("(prefers-reduced-motion: reduce)");
  readonly #onAppearanceChange = () => this.#applyAppearance();
  #languageObserver: MutationObserver | null = null;
  #showQueued = false;
  #muted = true;

  /** The address of what is shown, as the attribute has it. */
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
   * Whether its sound is off, as it always is at first. Its button for sound changes it, or a handler of the visitor's press in the page about it; switched on
   * without such, it is heard from the visitor's next press anywhere in the page, as browsers will have it.
   */
  get muted(): boolean {
    return this.#muted;
  }

  set muted(muted: boolean) {
    if (muted === this.#muted) return;
    this.#muted = muted;
    this.#applySoundPreference();
  }

  /** How loud, 0 to 1, as it is heard: 1 if nothing else is said. Throws `IndexSizeError` for another number, as `<video>` does. */
  get volume(): number {
    return parseVolume(this.getAttribute("volume"));
  }

  set volume(volume: number) {
    if (!(volume >= 0 && volume <= 1)) throw new DOMException(`${volume} is no volume: it is 0 to 1`, "IndexSizeError");
    this.setAttribute("volume", String(volume));
  }

  /** What comes over the line; null while there is none. It changes with `src`. */
  get viewer(): Viewer | null {
    return this.#controller?.playback?.viewer ?? null;
  }

  /** One's own hands; null while there is no line. */
  get puppeteer(): Puppeteer | null {
    return this.#controller?.playback?.puppeteer ?? null;
  }

  /** What draws; null before it is there, and where the browser cannot. */
  get stage(): Stage | null {
    return this.#controller?.renderer.stageController?.stage ?? null;
  }

  get playing(): boolean {
    return this.#controller?.playing ?? false;
  }

  /** Seconds in the dance. */
  get position(): number {
    return this.#controller?.playback?.position(performance.now()) ?? 0;
  }

  /** Seconds; 0 before it is known. */
  get duration(): number {
    return this.viewer?.duration ?? 0;
  }

  /** Plays; a session for everyone who watches it, where the link allows that. */
  play(): void {
    this.#controller?.setPlaying(true);
  }

  /** Pauses, likewise. */
  pause(): void {
    this.#controller?.setPlaying(false);
  }

  /** Goes to a time of the dance, in seconds; likewise. */
  seek(seconds: number): void {
    this.#controller?.seek(seconds);
  }

  connectedCallback(): void {
    // whatever it stands in may come to speak another
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

  /** Moved by `moveBefore`: nothing is to be done. */
  connectedMoveCallback(): void {}

  attributeChangedCallback(
    name: (typeof BunrakuStage.observedAttributes)[number],
    before: string | null,
    now: string | null,
  ): void {
    if (name === "lang") {
      if (this.#language) void this.#start();
      return;
    }
    if (name === "muted") {
      this.muted = now !== null;
      return;
    }
    if (name === "volume") {
      if (parseVolume(before) !== parseVolume(now)) this.#applySoundPreference();
      return;
    }
    if (!this.#controller || before === now) return;
    if (name === "theme" || name === "still") this.#applyAppearance();
    else if (name === "src" || (before === null) !== (now === null)) this.#scheduleShow();
  }

  /** Begins in the language of where it stands; what speaks that already, as it was but moved, goes on. */
  async #start(): Promise<void> {
    // by the nearest `lang`, or what the document came with
    const language = this.matches(":lang(ja)") ? "ja" : "en";
    if (language === this.#language) return;
    this.#stop();
    this.#language = language;
    const beginning = this.#startCount;
    const speech = language === "ja" ? await loadJapaneseTranslator() : new Translator();
    if (beginning !== this.#startCount) return;
    const root = this.shadowRoot ?? this.attachShadow({ mode: "open" });
    const memory = {
      load: () => ({ on: !this.#muted, volume: this.volume }),
      save: ({ on }: SoundPreference) => void (this.muted = !on),
    };
    this.#controller = new ElementController(root, speech, memory, (event, detail) =>
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
    // what is there from the beginning is no change
    if (this.#language) this.dispatchEvent(new Event("volumechange"));
  }

  /** Once for several attributes that change together. */
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

/** The volume that an attribute says; what is none says 1. */
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
