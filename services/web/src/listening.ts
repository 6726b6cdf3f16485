/** The sound of the motion on the stage: fetched where there is any, wanted or not, and the first gesture that lets it be heard. */
import { loadPreference, savePreference, type SoundPreference } from "./audio/preference";
import type { AudioPlayer, Speaker } from "./audio/sound";
import type { Viewer } from "./client/viewer";
import type { AudioStore } from "./playout/sounds";

/** What the button of the page shows. */
export interface SoundState {
  /** Whether the motion has sound. */
  readonly there: boolean;
  /** Whether it is heard. */
  readonly heard: boolean;
  readonly volume: number;
}

/** What browsers take for a person's wish that a page may be heard. */
const GESTURES = ["pointerdown", "pointerup", "click", "keydown"] as const;

export class Listening {
  #viewer: Viewer | null = null;
  #preference: SoundPreference = loadPreference();
  #speaker: Speaker | null = null;
  #player: AudioPlayer | null = null;
  /** What the player plays, or will when it is there. */
  #store: AudioStore | null = null;
  /** A gesture that let the sound be heard asked for it by that: the command it carries is done. */
  #woken = false;

  /** `changed` is told what to show; a press within `button` is no gesture, as it says what it wants itself. */
  constructor(private readonly changed: (state: SoundState) => void, button: Element) {
    for (const gesture of GESTURES) {
      addEventListener(gesture, (event) => {
        if (event.target instanceof Node && button.contains(event.target)) return;
        if (event instanceof KeyboardEvent && event.repeat) return;
        this.#wake();
      }, { capture: true, passive: true });
    }
  }

  /** What the sound is put out through, null before there is any. */
  get speaker(): Speaker | null {
    return this.#speaker;
  }

  /** The session that is watched from now on. */
  enter(viewer: Viewer): void {
    this.#viewer = viewer;
    viewer.addEventListener("figure", () => void this.#play());
    viewer.addEventListener("tracks", () => void this.#play());
    viewer.addEventListener("timeline", () => this.#player?.retime());
    void this.#play();
  }

  /** Heard or not, as a press of the button says. */
  toggle(): void {
    if (this.#woken || !this.#speaker) return;
    this.#prefer({ ...this.#preference, on: !this.#speaker.heard });
  }

  /** How loud, 0 to 1; who moves it wants to hear it. */
  set volume(volume: number) {
    this.#prefer({ on: true, volume });
  }

  #prefer(preference: SoundPreference): void {
    this.#preference = preference;
    savePreference(preference);
    if (this.#speaker) this.#apply(this.#speaker);
    this.#show();
  }

  #apply(speaker: Speaker): void {
    speaker.volume = this.#preference.volume;
    // a device that may be heard runs from its making on
    if (this.#preference.on) speaker.resume();
    else speaker.suspend();
  }

  #wake(): void {
    const speaker = this.#speaker;
    if (!speaker || speaker.heard || !this.#preference.on || !this.#store) return;
    speaker.resume();
    this.#woken = true;
    setTimeout(() => (this.#woken = false));
  }

  /** Plays the motion that the viewer shows, if it has sound. */
  async #play(): Promise<void> {
    const viewer = this.#viewer;
    const store = viewer?.sound ?? null;
    if (!viewer || store === this.#store) return;
    this.#player?.close();
    this.#player = null;
    this.#store = store;
    viewer.lead = null;
    this.#show();
    if (!store) {
      this.#speaker?.suspend();
      return;
    }
    try {
      const { AudioPlayer, findDecoder, Speaker } = await import("./audio/sound");
      const decoder = await findDecoder(store.track.channels);
      // another motion may have come on meanwhile
      if (store !== this.#store) return;
      this.#speaker ??= new Speaker(() => this.#show());
      const speaker = this.#speaker;
      const player = new AudioPlayer(speaker.context, speaker.output, {
        store, timelines: viewer.timelines, ownTime: (now) => viewer.ownTime(now), settled: () => viewer.clock.settled,
      }, decoder);
      this.#player = player;
      viewer.lead = (now) => player.leadAt(now);
      this.#apply(speaker);
    } catch (error) {
      console.warn("the sound of this motion cannot be heard here.", error);
    }
    this.#show();
  }

  #show(): void {
    this.changed({ there: this.#store !== null, heard: this.#speaker?.heard ?? false, volume: this.#preference.volume });
  }
}
