/**
 * Extended poses of a motion's performers: the blocks of their extensions that a viewer holds, and what they add to the
 * figures. The module is loaded when a motion has extensions.
 */

import { DamagedBlock } from "../codec/errors";
import { ContactTrack } from "../codec/extension/contact";
import {
  decodeExtensionBlock,
  type ExtensionBlock,
  type ExtensionPart,
  ExtensionTrack,
} from "../codec/extension/track";
import { createExtendedPose, extendPose, type StagedPose } from "../motion/extension";
import { EXPRESSIONS, type FacePose, faceExpressions } from "../motion/face";
import { CONTACT_PART, type FootContacts } from "../motion/foot-contact";
import type { HandsPose } from "../motion/hands";
import { createWorldTransforms, type Figure, worldTransforms } from "../motion/skeleton";
import type { Data, Track } from "../wire/messages";
import { TrackBlockStore } from "./block-store";
import { ContactBlockStore } from "./contact-store";

/** Decoded blocks of one extension, each at the highest level received. */
export class ExtensionBlockStore extends TrackBlockStore<ExtensionTrack, ExtensionBlock> {
  private readonly nextValues = new Float64Array(this.track.layout.count * 3);

  /**
   * Write the values at `position` of a motion of `duration` microseconds into `out`. If the block is missing, write
   * zeros and return false: the joints of a body then follow the figure alone.
   */
  valuesAt(position: number, loop: boolean, duration: number, out: Float64Array): boolean {
    const location = this.findBlock(position, loop, duration);
    if (!location) {
      out.fill(0);
      return false;
    }
    const { block, instant, following } = location;
    if (!following) {
      block.valuesAt(Math.min(Math.max(instant, -0.5), block.frames - 0.5), out);
      return true;
    }
    const { nextValues: next } = this;
    const mix = Math.min(instant - (block.frames - 1), 1);
    block.valuesAt(block.frames - 1, out);
    following.valuesAt(0, next);
    for (let n = 0; n < out.length; n++) out[n] += mix * (next[n] - out[n]);
    return true;
  }

  protected override decode(data: Uint8Array): ExtensionBlock {
    return decodeExtensionBlock(this.track, data);
  }
}

/** Position in a motion, with the motion's duration and the presented clock time, in microseconds. */
interface MotionInstant {
  readonly clock: number;
  readonly position: number;
  readonly loop: boolean;
  readonly duration: number;
}

/** Writes what one extension adds into a pose. */
type PosePart = (figure: Figure, pose: StagedPose, instant: MotionInstant) => void;

/** Return the function that writes an extension's part of a pose; it reuses its storage. */
function createPosePart(store: ExtensionBlockStore): PosePart {
  const { content, layout } = store.track;
  const values = new Float64Array(layout.count * 3);
  const read = ({ position, loop, duration }: MotionInstant) => store.valuesAt(position, loop, duration, values);
  switch (content.part) {
    case "body": {
      const world = createWorldTransforms();
      const extended = createExtendedPose(content.body);
      return (figure, pose, instant) => {
        read(instant);
        pose.extended = extendPose(figure, worldTransforms(figure, pose, world), values, extended);
      };
    }
    case "fingers": {
      const hands: HandsPose = { hands: content.hands, values };
      return (_, pose, instant) => {
        pose.hands = read(instant) ? hands : null;
      };
    }
    case "face": {
      const face: FacePose = { face: content.face, weights: new Float64Array(EXPRESSIONS.length) };
      return (_, pose, instant) => {
        pose.face = read(instant) ? face : null;
        if (pose.face) faceExpressions(face.face, values, face.weights);
      };
    }
  }
}

/** Return the function that writes the contacts of the feet into a pose; it reuses its storage. */
function createContactPart(store: ContactBlockStore): PosePart {
  const contacts: FootContacts = { planted: 0, controlled: 0, clock: 0 };
  return (_, pose, { position, clock }) => {
    contacts.planted = store.plantedAt(position);
    contacts.clock = clock;
    pose.contacts = contacts;
  };
}

/** Extensions of one performer. */
export class PerformerExtensions {
  private readonly parts = new Map<ExtensionPart | typeof CONTACT_PART, PosePart>();

  /** Add an extension; a second one of the same part is ignored. */
  add(store: ExtensionBlockStore | ContactBlockStore): void {
    const part = store instanceof ContactBlockStore ? CONTACT_PART : store.track.content.part;
    if (this.parts.has(part)) return;
    this.parts.set(part, store instanceof ContactBlockStore ? createContactPart(store) : createPosePart(store));
  }

  /** Write what the extensions add to the pose of `figure` at an instant; the next call reuses the storage. */
  extend(figure: Figure, pose: StagedPose, instant: MotionInstant): void {
    for (const write of this.parts.values()) write(figure, pose, instant);
  }
}

/** Extensions of one motion's performers. */
export class ExtensionPoses {
  private readonly stores = new Map<number, ExtensionBlockStore | ContactBlockStore>();
  private readonly performers = new Map<number, PerformerExtensions>();

  /** Add the extension tracks, by their index in the Description, that were not added yet. */
  add(tracks: ReadonlyMap<number, Track>): void {
    for (const [index, description] of tracks) {
      if (this.stores.has(index)) continue;
      try {
        const store =
          description.part === CONTACT_PART
            ? new ContactBlockStore(ContactTrack.fromDescription(description))
            : new ExtensionBlockStore(ExtensionTrack.fromDescription(description));
        this.stores.set(index, store);
        const { performer } = store.track;
        const extensions = this.performers.get(performer) ?? new PerformerExtensions();
        this.performers.set(performer, extensions);
        extensions.add(store);
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

  /** Return the extensions of a performer, or null if it has none. */
  performer(number: number): PerformerExtensions | null {
    return this.performers.get(number) ?? null;
  }
}
