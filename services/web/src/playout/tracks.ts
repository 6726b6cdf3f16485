/** The tracks of a stream that are known here: the dance, and the cameras and lights beside it. */

import { DamagedBlock } from "../codec/errors";
import { SceneTrack } from "../codec/scene";
import { MotionTrack } from "../codec/track";
import type { Track } from "../wire/messages";
import { BlockStore, SceneStore } from "./blocks";

export class Tracks {
  readonly dance: BlockStore;
  /** Cameras and lights, in the Description's order. */
  readonly scenes: readonly SceneStore[];
  /** By index in the Description; tracks that are not known here are missing. */
  private readonly stores = new Map<number, BlockStore | SceneStore>();

  /**
   * @param described the `tracks` of a Description; those of a type or codec that is not known here are skipped
   * @throws DamagedBlock where there is no motion among them that can be played here
   */
  constructor(described: readonly Track[]) {
    const index = described.findIndex(({ type }) => type === "motion");
    if (index < 0) throw new DamagedBlock("the stream has no motion in it");
    this.dance = new BlockStore(MotionTrack.fromDescription(described[index]));
    this.stores.set(index, this.dance);
    const scenes: SceneStore[] = [];
    described.forEach((map, number) => {
      if (map.type !== "camera" && map.type !== "light") return;
      try {
        const store = new SceneStore(SceneTrack.fromDescription(map));
        this.stores.set(number, store);
        scenes.push(store);
      } catch (error) {
        if (!(error instanceof DamagedBlock)) throw error;
        console.warn(`a ${map.type} of this motion cannot be shown here: ${error.message}`);
      }
    });
    this.scenes = scenes;
  }

  /** What keeps the blocks of the track of this index, null where it is not known here. */
  store(track: number): BlockStore | SceneStore | null {
    return this.stores.get(track) ?? null;
  }
}
