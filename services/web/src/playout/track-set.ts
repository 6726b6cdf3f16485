/** Tracks of a stream that a viewer can play: performers, audio, cameras and lights. */

import { AudioTrack } from "../codec/audio";
import { DamagedBlock } from "../codec/errors";
import { MotionTrack } from "../codec/motion-track";
import { SceneTrack } from "../codec/scene";
import { MAX_PERFORMERS } from "../wire/limbs";
import type { Track } from "../wire/messages";
import { AudioBlockStore } from "./audio-store";
import { MotionBlockStore, SceneBlockStore } from "./block-store";

type AnyBlockStore = MotionBlockStore | SceneBlockStore | AudioBlockStore;

/** Block stores of one motion's tracks. */
export class TrackSet {
  /** Store of the first performer, whose duration is that of the motion. */
  readonly firstPerformer: MotionBlockStore;
  /** Stores of the performers, in the Description's order; null for one that cannot be played: it keeps its number. */
  readonly performers: (MotionBlockStore | null)[] = [];
  /** Cameras and lights, in the Description's order. */
  readonly scenes: SceneBlockStore[] = [];
  /** Store of the first audio track that can be played, if any. */
  audio: AudioBlockStore | null = null;
  /** Descriptions of the extension tracks, by index. */
  readonly extensions = new Map<number, Track>();
  /** Number of tracks that were described. */
  describedCount = 0;
  /** Stores by the track's index in the Description. */
  private readonly stores = new Map<number, AnyBlockStore>();

  /**
   * @param descriptions `tracks` of a Description; those of an unknown type or codec are skipped
   * @throws DamagedBlock if there is no motion track, or the first one cannot be played
   */
  constructor(descriptions: readonly Track[]) {
    const index = descriptions.findIndex(({ type }) => type === "motion");
    if (index < 0) {
      const types = descriptions.map(({ type }) => type).join(", ") || "none";
      throw new DamagedBlock(`The stream has no motion track (types of its tracks: ${types}).`);
    }
    this.firstPerformer = new MotionBlockStore(MotionTrack.fromDescription(descriptions[index]));
    this.add(0, descriptions);
  }

  /**
   * Add the tracks from index `first` on that were not described yet. On a constrained link they are described after
   * the first blocks.
   */
  add(first: number, descriptions: readonly Track[]): void {
    descriptions.forEach((description, nth) => {
      const index = first + nth;
      if (index < this.describedCount) return;
      if (description.type === "extension") this.extensions.set(index, description);
      try {
        const store = this.createStore(description);
        if (store) this.stores.set(index, store);
      } catch (error) {
        if (!(error instanceof DamagedBlock)) throw error;
        if (description.type === "motion") this.performers.push(null);
        console.warn(`Skipped track ${index} (${description.type}) of the stream: ${error.message}`);
      }
    });
    this.describedCount = Math.max(this.describedCount, first + descriptions.length);
  }

  /** Return the store of the track with this index, or null if it cannot be played. */
  store(index: number): AnyBlockStore | null {
    return this.stores.get(index) ?? null;
  }

  /** Create and register the store of the next track, or return null if the track is not used. */
  private createStore(description: Track): AnyBlockStore | null {
    switch (description.type) {
      case "motion": {
        if (this.performers.length >= MAX_PERFORMERS) return null;
        const store =
          this.performers.length === 0
            ? this.firstPerformer
            : new MotionBlockStore(MotionTrack.fromDescription(description));
        this.performers.push(store);
        return store;
      }
      case "camera":
      case "light": {
        const store = new SceneBlockStore(SceneTrack.fromDescription(description));
        this.scenes.push(store);
        return store;
      }
      case "audio":
        if (this.audio) return null;
        return (this.audio = new AudioBlockStore(AudioTrack.fromDescription(description, this.firstPerformer.track)));
      default:
        return null;
    }
  }
}
