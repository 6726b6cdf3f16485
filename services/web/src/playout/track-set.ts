/** The tracks of a stream that are known here: the dance, and the other performers, the sound, the cameras and the lights beside it. */

import { AudioTrack } from "../codec/audio";
import { DamagedBlock } from "../codec/errors";
import { MotionTrack } from "../codec/motion-track";
import { SceneTrack } from "../codec/scene";
import { MAX_PERFORMERS } from "../wire/limbs";
import type { Track } from "../wire/messages";
import { AudioBlockStore } from "./audio-store";
import { MotionBlockStore, SceneBlockStore } from "./block-store";

type AnyBlockStore = MotionBlockStore | SceneBlockStore | AudioBlockStore;

export class TrackSet {
  /** The first performer's: its length is the motion's. */
  readonly firstPerformer: MotionBlockStore;
  /** By number, null of one that cannot be read: it keeps its number, by which limbs are told apart. */
  readonly performers: (MotionBlockStore | null)[] = [];
  /** Cameras and lights, in the Description's order. */
  readonly scenes: SceneBlockStore[] = [];
  /** The sound, null where there is none: the first of the Description. */
  audio: AudioBlockStore | null = null;
  /** How many tracks were told of. */
  describedCount = 0;
  /** By index in the Description; tracks that are not known here are missing. */
  private readonly stores = new Map<number, AnyBlockStore>();

  /**
   * @param described the `tracks` of a Description; those of a type or codec that is not known here are skipped
   * @throws DamagedBlock where there is no motion among them, or the first cannot be played here
   */
  constructor(described: readonly Track[]) {
    const index = described.findIndex(({ type }) => type === "motion");
    if (index < 0) throw new DamagedBlock("the stream has no motion in it");
    this.firstPerformer = new MotionBlockStore(MotionTrack.fromDescription(described[index]));
    this.add(0, described);
  }

  /** Takes in the tracks from index `first` on that were not told of yet: a narrow line may bring them after the first blocks. */
  add(first: number, descriptions: readonly Track[]): void {
    descriptions.forEach((map, nth) => {
      const number = first + nth;
      if (number < this.describedCount) return;
      try {
        const store = this.createStore(map);
        if (store) this.stores.set(number, store);
      } catch (error) {
        if (!(error instanceof DamagedBlock)) throw error;
        if (map.type === "motion") this.performers.push(null);
        console.warn(`the ${map.type} at ${number} of this stream is left out: ${error.message}`);
      }
    });
    this.describedCount = Math.max(this.describedCount, first + descriptions.length);
  }

  /** What the next track told of is kept in, null where it is of no use here. */
  private createStore(map: Track): AnyBlockStore | null {
    if (map.type === "motion" && this.performers.length < MAX_PERFORMERS) {
      const store =
        this.performers.length === 0 ? this.firstPerformer : new MotionBlockStore(MotionTrack.fromDescription(map));
      this.performers.push(store);
      return store;
    }
    if (map.type === "camera" || map.type === "light") {
      const store = new SceneBlockStore(SceneTrack.fromDescription(map));
      this.scenes.push(store);
      return store;
    }
    if (map.type === "audio" && !this.audio)
      return (this.audio = new AudioBlockStore(AudioTrack.fromDescription(map, this.firstPerformer.track)));
    return null;
  }

  /** What keeps the blocks of the track of this index, null where it is not known here. */
  store(track: number): AnyBlockStore | null {
    return this.stores.get(track) ?? null;
  }
}
