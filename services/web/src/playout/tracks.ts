/** The tracks of a stream that are known here: the dance, and the sound, the cameras and the lights beside it. */

import { AudioTrack } from "../codec/audio";
import { DamagedBlock } from "../codec/errors";
import { SceneTrack } from "../codec/scene";
import { MotionTrack } from "../codec/track";
import type { Track } from "../wire/messages";
import { BlockStore, SceneStore } from "./blocks";
import { AudioStore } from "./sounds";

type TrackStore = BlockStore | SceneStore | AudioStore;

export class Tracks {
  readonly dance: BlockStore;
  /** Cameras and lights, in the Description's order. */
  readonly scenes: SceneStore[] = [];
  /** The sound, null where there is none: the first of the Description. */
  sound: AudioStore | null = null;
  /** How many tracks were told of. */
  told = 0;
  /** By index in the Description; tracks that are not known here are missing. */
  private readonly stores = new Map<number, TrackStore>();

  /**
   * @param described the `tracks` of a Description; those of a type or codec that is not known here are skipped
   * @throws DamagedBlock where there is no motion among them that can be played here
   */
  constructor(described: readonly Track[]) {
    const index = described.findIndex(({ type }) => type === "motion");
    if (index < 0) throw new DamagedBlock("the stream has no motion in it");
    this.dance = new BlockStore(MotionTrack.fromDescription(described[index]));
    this.stores.set(index, this.dance);
    this.add(0, described);
  }

  /** Takes in the tracks from index `first` on that were not told of yet: a narrow line may bring them after the first blocks. */
  add(first: number, described: readonly Track[]): void {
    described.forEach((map, nth) => {
      const number = first + nth;
      if (number < this.told) return;
      try {
        if (map.type === "camera" || map.type === "light") {
          const store = new SceneStore(SceneTrack.fromDescription(map));
          this.stores.set(number, store);
          this.scenes.push(store);
        } else if (map.type === "audio" && !this.sound) {
          this.sound = new AudioStore(AudioTrack.fromDescription(map, this.dance.track));
          this.stores.set(number, this.sound);
        }
      } catch (error) {
        if (!(error instanceof DamagedBlock)) throw error;
        console.warn(`the ${map.type} of this motion is left out: ${error.message}`);
      }
    });
    this.told = Math.max(this.told, first + described.length);
  }

  /** What keeps the blocks of the track of this index, null where it is not known here. */
  store(track: number): TrackStore | null {
    return this.stores.get(track) ?? null;
  }
}
