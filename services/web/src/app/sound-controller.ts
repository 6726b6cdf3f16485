/** Sound of the motion on the stage. Audio code is loaded once a motion has sound and the person wants to hear it. */

import type { AudioPackets } from "../audio/player";
import type { SoundPreference, SoundPreferenceStore } from "../audio/preference";
import type { AudioPlayer } from "../audio/sound";
import { Speaker } from "../audio/speaker";
import type { LeaderTime } from "../playout/presentation-clock";
import type { TimelineHistory } from "../playout/timeline";

/** State that the sound button shows. */
export interface SoundState {
  /** True if the motion has sound. */
  readonly available: boolean;
  /** True if it can be heard now. */
  readonly audible: boolean;
  readonly volume: number;
}

/**
 * Viewer whose sound is played. Its events "figure", "tracks" and "timeline" announce another `audio` and changes of
 * the timeline.
 */
export interface SoundSource extends EventTarget {
  /** Packets of the motion's audio track, null if it has none. */
  readonly audio: AudioPackets | null;
  readonly timelineHistory: TimelineHistory;
  /** True if the clock estimate will change little. */
  readonly isClockSettled: boolean;
  /** Return the reference time that the stage would present without sound at local `nowMs`, microseconds. */
  ownTime(nowMs: number): number;
  /** Source of the stage time that the audio presents at local `nowMs`. */
  leader: ((nowMs: number) => LeaderTime | null) | null;
}

/**
 * Time after which a browser that was allowed to play sound and does not is reported, in milliseconds. Without an audio
 * device, an audio context may wait for ever.
 */
const START_TIMEOUT_MS = 8_000;

/** Events that browsers accept as the user activation that audio playback requires. */
const USER_ACTIVATION_EVENTS = ["pointerdown", "pointerup", "click", "keydown"] as const;

export class SoundController {
  #viewer: SoundSource | null = null;
  #preference: SoundPreference;
  #speaker: Speaker | null = null;
  #player: AudioPlayer | null = null;
  /** Sound of the current motion; null if it has none. */
  #audioStore: AudioPackets | null = null;
  /** Set while the gesture that resumed the sound is handled: its own command must not switch the sound off again. */
  #resumedByGesture = false;
  /** Timer of `START_TIMEOUT_MS`; undefined before a gesture, and null after silence was reported. */
  #startTimer: ReturnType<typeof setTimeout> | undefined | null;
  readonly #abortController = new AbortController();

  /**
   * Gestures within `button` do not resume the sound, since the button toggles it itself. `onSilence` is called once if
   * the browser cannot play sound, or plays none although it was allowed to.
   */
  constructor(
    private readonly onChange: (state: SoundState) => void,
    button: Element,
    private readonly preferenceStore: SoundPreferenceStore,
    private readonly onSilence: () => void = () => undefined,
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

  /** Audio output; null until sound was first wanted. */
  get speaker(): Speaker | null {
    return this.#speaker;
  }

  /** Play the sound of this viewer's motions; null stops the sound. */
  setViewer(viewer: SoundSource | null): void {
    this.#viewer = viewer;
    viewer?.addEventListener("figure", () => void this.#updatePlayer());
    viewer?.addEventListener("tracks", () => void this.#updatePlayer());
    viewer?.addEventListener("timeline", () => this.#player?.retime());
    void this.#updatePlayer();
  }

  /** Switch the sound on or off. */
  toggle(): void {
    if (this.#resumedByGesture || !this.#audioStore) return;
    this.setPreference({ ...this.#preference, on: !this.#speaker?.heard });
    this.#expectSound();
  }

  /** Set the volume, 0 to 1, and switch the sound on. */
  set volume(volume: number) {
    this.setPreference({ on: true, volume });
  }

  /** Apply and save whether sound is wanted, and its volume. */
  setPreference(preference: SoundPreference): void {
    this.#preference = preference;
    this.preferenceStore.save(preference);
    if (this.#speaker) this.#applyPreference(this.#speaker);
    void this.#updatePlayer();
  }

  /** Stop the sound and free the audio device. */
  close(): void {
    this.#abortController.abort();
    this.setViewer(null);
    clearTimeout(this.#startTimer ?? undefined);
    this.#speaker?.close();
  }

  #applyPreference(speaker: Speaker): void {
    speaker.volume = this.#preference.volume;
    // An audio device that the browser allows runs as soon as it is created, so it may have to be suspended.
    if (this.#preference.on && this.#audioStore) speaker.resume();
    else speaker.suspend();
  }

  #resumeOnGesture(): void {
    const speaker = this.#speaker;
    if (!speaker || speaker.heard || !this.#preference.on || !this.#audioStore) return;
    speaker.resume();
    this.#expectSound();
    this.#resumedByGesture = true;
    setTimeout(() => (this.#resumedByGesture = false));
  }

  /** Report, once, a browser that plays no sound some time after a gesture that started it. */
  #expectSound(): void {
    if (this.#startTimer !== undefined) return;
    this.#startTimer = setTimeout(() => {
      this.#startTimer = undefined;
      if (!this.#preference.on || !this.#audioStore || this.#speaker?.heard) return;
      this.#reportSilence();
    }, START_TIMEOUT_MS);
  }

  #reportSilence(): void {
    if (this.#startTimer === null) return;
    clearTimeout(this.#startTimer);
    this.#startTimer = null;
    this.onSilence();
  }

  /** Replace the player if the motion changed; create one if the motion has sound and sound is wanted. */
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
      // Before any await: some browsers only allow audio that is started within the gesture.
      const speaker = this.#speaker ?? this.#openSpeaker();
      const { AudioPlayer, findDecoder } = await import("../audio/sound");
      const decoder = await findDecoder(store.track.channels);
      // Meanwhile the motion may have changed, or a concurrent call may have created the player.
      if (store !== this.#audioStore || this.#player) return;
      const player = new AudioPlayer(
        speaker.context,
        speaker.output,
        {
          store,
          timelines: viewer.timelineHistory,
          viewerTime: (now) => viewer.ownTime(now),
          isClockSettled: () => viewer.isClockSettled,
        },
        decoder,
      );
      this.#player = player;
      viewer.leader = (now) => player.leadAt(now);
    } catch (error) {
      this.#speaker?.suspend();
      console.warn("The sound of this motion cannot be played.", error);
      this.#reportSilence();
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
      available: this.#audioStore !== null,
      audible: this.#speaker?.heard ?? false,
      volume: this.#preference.volume,
    });
  }
}
