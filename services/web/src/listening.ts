/** The sound of the motion on the stage: fetched where there is any and it is wanted, and the first gesture that lets it be heard. */
import type { SoundMemory, SoundPreference } from "./audio/preference";
import type { AudioPlayer } from "./audio/sound";
import { Speaker } from "./audio/speaker";
import type { Viewer } from "./client/viewer";
import type { AudioStore } from "./playout/sounds";

/** What the button shows. */
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
  #preference: SoundPreference;
  #speaker: Speaker | null = null;
  #player: AudioPlayer | null = null;
  /** What the player plays, or will when it is there. */
  #store: AudioStore | null = null;
  /** A gesture that let the sound be heard asked for it by that: the command it carries is done. */
  #woken = false;
  readonly #ended = new AbortController();

  /** `changed` is told what to show; a press within `button` is no gesture, as it says what it wants itself. */
  constructor(private readonly changed: (state: SoundState) => void, button: Element, private readonly memory: SoundMemory) {
    this.#preference = memory.load();
    for (const gesture of GESTURES) {
      addEventListener(gesture, (event) => {
        if (event.composedPath().includes(button)) return;
        if (event instanceof KeyboardEvent && event.repeat) return;
        this.#wake();
      }, { capture: true, passive: true, signal: this.#ended.signal });
    }
  }

  /** What the sound is put out through, null before there is any. */
  get speaker(): Speaker | null {
    return this.#speaker;
  }

  /** What is watched from now on; null is silent. */
  enter(viewer: Viewer | null): void {
    this.#viewer = viewer;
    viewer?.addEventListener("figure", () => void this.#play());
    viewer?.addEventListener("tracks", () => void this.#play());
    viewer?.addEventListener("timeline", () => this.#player?.retime());
    void this.#play();
  }

  /** Heard or not, as a press of the button says. */
  toggle(): void {
    if (this.#woken || !this.#store) return;
    this.prefer({ ...this.#preference, on: !this.#speaker?.heard });
  }

  /** How loud, 0 to 1; who moves it wants to hear it. */
  set volume(volume: number) {
    this.prefer({ on: true, volume });
  }

  /** Whether it is wanted, and how loud: from now on, and remembered. */
  prefer(preference: SoundPreference): void {
    this.#preference = preference;
    this.memory.save(preference);
    if (this.#speaker) this.#apply(this.#speaker);
    void this.#play();
  }

  /** Ends it for good. */
  close(): void {
    this.#ended.abort();
    this.enter(null);
    this.#speaker?.close();
  }

  #apply(speaker: Speaker): void {
    speaker.volume = this.#preference.volume;
    // a device that may be heard runs from its making on
    if (this.#preference.on && this.#store) speaker.resume();
    else speaker.suspend();
  }

  #wake(): void {
    const speaker = this.#speaker;
    if (!speaker || speaker.heard || !this.#preference.on || !this.#store) return;
    speaker.resume();
    this.#woken = true;
    setTimeout(() => (this.#woken = false));
  }

  /** Plays the motion that the viewer shows, if it has sound and that is wanted. */
  async #play(): Promise<void> {
    const viewer = this.#viewer;
    const store = viewer?.sound ?? null;
    if (store !== this.#store) {
      this.#player?.close();
      this.#player = null;
      this.#store = store;
      if (viewer) viewer.lead = null;
      if (this.#speaker) this.#apply(this.#speaker);
    }
    this.#show();
    if (!viewer || !store || !this.#preference.on || this.#player) return;
    try {
      // now: there are browsers that let be heard only what begins within the gesture
      const speaker = this.#speaker ?? this.#openSpeaker();
      const { AudioPlayer, findDecoder } = await import("./audio/sound");
      const decoder = await findDecoder(store.track.channels);
      // another motion may have come on meanwhile, or it may be asked for twice
      if (store !== this.#store || this.#player) return;
      const player = new AudioPlayer(speaker.context, speaker.output, {
        store, timelines: viewer.timelines, ownTime: (now) => viewer.ownTime(now), settled: () => viewer.clock.settled,
      }, decoder);
      this.#player = player;
      viewer.lead = (now) => player.leadAt(now);
    } catch (error) {
      this.#speaker?.suspend();
      console.warn("the sound of this motion cannot be heard here.", error);
    }
    this.#show();
  }

  #openSpeaker(): Speaker {
    const speaker = new Speaker(() => this.#show());
    this.#speaker = speaker;
    this.#apply(speaker);
    return speaker;
  }

  #show(): void {
    this.changed({ there: this.#store !== null, heard: this.#speaker?.heard ?? false, volume: this.#preference.volume });
  }
}
