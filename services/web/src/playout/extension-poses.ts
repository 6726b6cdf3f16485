/**
 * Extended poses of a motion's performers: the blocks of their extensions that a viewer holds, and what they add to the
 * figures. The module is loaded when a motion has extensions.
 */

import { DamagedBlock } from "../codec/errors";
import { decodeExtensionBlock, type ExtensionBlock, ExtensionTrack } from "../codec/extension-track";
import { createExtendedPose, type ExtendedPose, extendPose } from "../motion/extension";
import { createWorldTransforms, type Figure, type Pose, worldTransforms } from "../motion/skeleton";
import type { Data, Track } from "../wire/messages";
import { TrackBlockStore } from "./block-store";

/** Decoded blocks of one extension, each at the highest level received. */
export class ExtensionBlockStore extends TrackBlockStore<ExtensionTrack, ExtensionBlock> {
  private readonly nextValues = new Float64Array(this.track.extension.kinds.length * 3);

  /**
   * Write the values at `position` of a motion of `duration` microseconds into `out`; zeros if the block is missing: the
   * joints then follow the figure alone.
   */
  valuesAt(position: number, loop: boolean, duration: number, out: Float64Array): void {
    const location = this.findBlock(position, loop, duration);
    if (!location) {
      out.fill(0);
      return;
    }
    const { block, instant, following } = location;
    if (!following) {
      block.valuesAt(Math.min(Math.max(instant, -0.5), block.frames - 0.5), out);
      return;
    }
    const { nextValues: next } = this;
    const mix = Math.min(instant - (block.frames - 1), 1);
    block.valuesAt(block.frames - 1, out);
    following.valuesAt(0, next);
    for (let n = 0; n < out.length; n++) out[n] += mix * (next[n] - out[n]);
  }

  protected override decode(data: Uint8Array): ExtensionBlock {
    return decodeExtensionBlock(this.track, data);
  }
}

/** Extension of one performer with the storage of its poses. */
export class PerformerExtension {
  private readonly world = createWorldTransforms();
  private readonly values: Float64Array;
  private readonly extended: ExtendedPose;

  constructor(readonly store: ExtensionBlockStore) {
    const { extension } = store.track;
    this.values = new Float64Array(extension.kinds.length * 3);
    this.extended = createExtendedPose(extension);
  }

  /** Return the extended pose of `figure` at `position`; the next call reuses the storage. */
  extend(figure: Figure, pose: Pose, position: number, loop: boolean, duration: number): ExtendedPose {
    this.store.valuesAt(position, loop, duration, this.values);
    return extendPose(figure, worldTransforms(figure, pose, this.world), this.values, this.extended);
  }
}

/** Extensions of one motion's performers. */
export class ExtensionPoses {
  private readonly stores = new Map<number, ExtensionBlockStore>();
  private readonly performers = new Map<number, PerformerExtension>();

  /** Add the extension tracks, by their index in the Description, that were not added yet. */
  add(tracks: ReadonlyMap<number, Track>): void {
    for (const [index, description] of tracks) {
      if (this.stores.has(index)) continue;
      try {
        const store = new ExtensionBlockStore(ExtensionTrack.fromDescription(description));
        this.stores.set(index, store);
        if (!this.performers.has(store.track.performer))
          this.performers.set(store.track.performer, new PerformerExtension(store));
      } catch (error) {
        if (!(error instanceof DamagedBlock)) throw error;
        console.warn(`Skipped track ${index} (extension) of the stream: ${error.message}`);
      }
    }
  }

  /** Store a block. Return false if it cannot be decoded or does not belong to its track. */
  put({ track, index, rate, block }: Data): boolean {
    try {
      this.stores.get(track)?.put(index, rate, block);
      return true;
    } catch (error) {
      if (!(error instanceof DamagedBlock)) throw error;
      return false;
    }
  }

  /** Return the extension of a performer, or null if it has none. */
  performer(number: number): PerformerExtension | null {
    return this.performers.get(number) ?? null;
  }
}
