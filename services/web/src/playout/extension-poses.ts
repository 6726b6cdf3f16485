/**
 * What extensions add to the poses of a motion's performers, and to the stage. The module is loaded when a motion has
 * extensions; that of their values only if it has more than contacts of feet and props.
 */

import { DamagedBlock } from "../codec/errors";
import { ContactTrack } from "../codec/extension/contact";
import { PROP_PART, PropTrack } from "../codec/extension/props";
import type { StagedPose } from "../motion/extension";
import { CONTACT_PART, type FootContacts } from "../motion/foot-contact";
import type { Figure } from "../motion/skeleton";
import { MAX_PROPS } from "../wire/limbs";
import type { Data, PropPresence, Track } from "../wire/messages";
import { ContactBlockStore } from "./contact-store";
import { PropBlockStore } from "./prop-store";

/** Position in a motion, with the motion's duration and the presented clock time, in microseconds. */
export interface MotionInstant {
  readonly clock: number;
  readonly position: number;
  readonly loop: boolean;
  readonly duration: number;
}

/** Writes what one extension adds into a pose. */
export type PosePart = (figure: Figure, pose: StagedPose, instant: MotionInstant) => void;

/** An extension of one performer: its blocks, and what writes its part of a pose. */
export interface OpenedExtension {
  readonly store: { put(index: number, level: number, block: Uint8Array): void };
  readonly part: string;
  readonly performer: number;
  readonly write: PosePart;
}

function openContacts(description: Track): OpenedExtension {
  const store = new ContactBlockStore(ContactTrack.fromDescription(description));
  return { store, part: CONTACT_PART, performer: store.track.performer, write: createContactPart(store) };
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
  private readonly parts = new Map<string, PosePart>();

  /** Add an extension; a second one of the same part is ignored. */
  add({ part, write }: OpenedExtension): void {
    if (!this.parts.has(part)) this.parts.set(part, write);
  }

  /** Write what the extensions add to the pose of `figure` at an instant; the next call reuses the storage. */
  extend(figure: Figure, pose: StagedPose, instant: MotionInstant): void {
    for (const write of this.parts.values()) write(figure, pose, instant);
  }
}

/** Extensions of one motion's performers. */
export class ExtensionPoses {
  private readonly opened = new Map<number, OpenedExtension>();
  private readonly performers = new Map<number, PerformerExtensions>();
  private readonly props: PropBlockStore[] = [];

  /** @param openExtension opens tracks of values; null leaves them out until it is set and they are added again */
  constructor(public openExtension: ((description: Track) => OpenedExtension) | null = null) {}

  /** Add the extension tracks, by their index in the Description, that were not added yet. */
  add(tracks: ReadonlyMap<number, Track>): void {
    for (const [index, description] of tracks) {
      const open = this.openerOf(description);
      if (!open || this.opened.has(index)) continue;
      try {
        const extension = open(description);
        this.opened.set(index, extension);
        const extensions = this.performers.get(extension.performer) ?? new PerformerExtensions();
        this.performers.set(extension.performer, extensions);
        extensions.add(extension);
      } catch (error) {
        if (!(error instanceof DamagedBlock)) throw error;
        console.warn(`Skipped track ${index} (extension) of the stream: ${error.message}`);
      }
    }
  }

  /** Return the props of the motion at a motion time (microseconds), with numbers after those of a session. */
  propsAt(position: number): PropPresence[] {
    return this.props.flatMap((store, index) => store.propsAt(position, MAX_PROPS * (1 + index)));
  }

  /** Store a block. Return false if it cannot be decoded or does not belong to its track. */
  put({ track, index, rate, block }: Data): boolean {
    try {
      this.opened.get(track)?.store.put(index, rate, block);
      return true;
    } catch (error) {
      if (!(error instanceof DamagedBlock)) throw error;
      return false;
    }
  }

  private openerOf({ part }: Track): ((description: Track) => OpenedExtension) | null {
    if (part === CONTACT_PART) return openContacts;
    return part === PROP_PART ? (description) => this.openProps(description) : this.openExtension;
  }

  private openProps(description: Track): OpenedExtension {
    const store = new PropBlockStore(PropTrack.fromDescription(description));
    this.props.push(store);
    return { store, part: PROP_PART, performer: store.track.performer, write: () => undefined };
  }

  /** Return the extensions of a performer, or null if it has none. */
  performer(number: number): PerformerExtensions | null {
    return this.performers.get(number) ?? null;
  }
}
