/** The sound of the motion on the stage: fetched where there is any and it is wanted, and the first gesture that lets it be heard. */
import type { SoundPreference, SoundPreferenceStore } from "../audio/preference";
import type { AudioPlayer } from "../audio/sound";
import { Speaker } from "../audio/speaker";
import type { Viewer } from "../client/viewer";
import type { AudioBlockStore } from "../playout/audio-store";

/** What the button shows. */
export interface SoundState {
  /** Whether the motion has sound. */
  readonly there: boolean;
  /** Whether it is heard. */
  readonly heard: boolean;
  readonly volume: number;
}

/** What browsers take for a person's wish that a page may be heard. */
const USER_ACTIVATION_EVENTS = ["pointerdown", "pointerup", "click", "keydown"] as const;

export class SoundController {
  #viewer: Viewer | null = null;
  #preference: SoundPreference;
  #speaker: Speaker | null = null;
  #player: AudioPlayer | null = null;
  /** What the player plays, or will when it is there. */
  #audioStore: AudioBlockStore | null = null;
  /** A gesture that let the sound be heard asked for it by that: the command it carries is done. */
  #resumedByGesture = false;
  readonly #abortController = new AbortController();

  /** `changed` is told what to show; a press within `button` is no gesture, as it says what it wants itself. */
  constructor(
    private readonly onChange: (state: SoundState) => void,
    button: Element,
    private readonly preferenceStore: SoundPreferenceStore,
  ) {
    this.#preference = preferenceStore.load();
    for (const gesture of USER_ACTIVATION_EVENTS) {
      addEventListener(
        gesture,
        (event) => {
          if (event.composedPath().includes(button)) return;
          if (event instanceof KeyboardEvent && event.repeat) return;
          this.#resumeOnGesture();
        },
        { capture: true, passive: true, signal: this.#abortController.signal },
      );
    }
  }

  /** What the sound is put out through, null before there is any. */
  get speaker(): Speaker | null {
    return this.#speaker;
  }

  /** What is watched from now on; null is silent. */
  setViewer(viewer: Viewer | null): void {
    this.#viewer = viewer;
    viewer?.addEventListener("figure", () => void this.#updatePlayer());
    viewer?.addEventListener("tracks", () => void this.#updatePlayer());
    viewer?.addEventListener("timeline", () => this.#player?.retime());
    void this.#updatePlayer();
  }

  /** Heard or not, as a press of the button says. */
  toggle(): void {
    if (this.#resumedByGesture || !this.#audioStore) return;
    this.setPreference({ ...this.#preference, on: !this.#speaker?.heard });
  }

  /** How loud, 0 to 1; who moves it wants to hear it. */
  set volume(volume: number) {
    this.setPreference({ on: true, volume });
  }

  /** Whether it is wanted, and how loud: from now on, and remembered. */
  setPreference(preference: SoundPreference): void {
    this.#preference = preference;
    this.preferenceStore.save(preference);
    if (this.#speaker) this.#applyPreference(this.#speaker);
    void this.#updatePlayer();
  }

  /** Ends it for good. */
  close(): void {
    this.#abortController.abort();
    this.setViewer(null);
    this.#speaker?.close();
  }

  #applyPreference(speaker: Speaker): void {
    speaker.volume = this.#preference.volume;
    // a device that may be heard runs from its making on
    if (this.#preference.on && this.#audioStore) speaker.resume();
    else speaker.suspend();
  }

  #resumeOnGesture(): void {
    const speaker = this.#speaker;
    if (!speaker || speaker.heard || !this.#preference.on || !this.#audioStore) return;
    speaker.resume();
    this.#resumedByGesture = true;
    setTimeout(() => (this.#resumedByGesture = false));
  }

  /** Plays the motion that the viewer shows, if it has sound and that is wanted. */
  async #updatePlayer(): Promise<void> {
    const viewer = this.#viewer;
    const store = viewer?.audio ?? null;
    if (store !== this.#audioStore) {
      this.#player?.close();
      this.#player = null;
      this.#audioStore = store;
      if (viewer) viewer.leader = null;
      if (this.#speaker) this.#applyPreference(this.#speaker);
    }
    this.#publishState();
    if (!viewer || !store || !this.#preference.on || this.#player) return;
    try {
      // now: there are browsers that let be heard only what begins within the gesture
      const speaker = this.#speaker ?? this.#openSpeaker();
      const { AudioPlayer, findDecoder } = await import("../audio/sound");
      const decoder = await findDecoder(store.track.channels);
      // another motion may have come on meanwhile, or it may be asked for twice
      if (store !== this.#audioStore || this.#player) return;
      const player = new AudioPlayer(
        speaker.context,
        speaker.output,
        {
          store,
          timelines: viewer.timelineHistory,
          viewerTime: (now) => viewer.ownTime(now),
          isClockSettled: () => viewer.clock.isSettled,
        },
        decoder,
      );
      this.#player = player;
      viewer.leader = (now) => player.leadAt(now);
    } catch (error) {
      this.#speaker?.suspend();
      console.warn("the sound of this motion cannot be heard here.", error);
    }
    this.#publishState();
  }

  #openSpeaker(): Speaker {
    const speaker = new Speaker(() => this.#publishState());
    this.#speaker = speaker;
    this.#applyPreference(speaker);
    return speaker;
  }

  #publishState(): void {
    this.onChange({
      there: this.#audioStore !== null,
      heard: this.#speaker?.heard ?? false,
      volume: this.#preference.volume,
    });
  }
}
