/**
 * Contacts of a performer's feet with the floor: their track and the decoder of its blocks (`proto/codec.md`, 2.20).
 */

import { FEET } from "../../motion/foot-contact";
import { DamagedBlock } from "../errors";
import { Leb128Reader } from "../leb128";
import { parseTiming, Timing, type TrackDescription } from "../timing";

const CONTACT_CODEC = "bunraku.contact/1";

/** Timing of the contacts of one performer, which has this index among the motion's. */
export class ContactTrack extends Timing {
  constructor(
    timing: Timing,
    readonly performer: number,
  ) {
    super(timing.fps, timing.frames, timing.blockFrames, timing.firstFrames);
  }

  /**
   * Returns the track of a Description's map of type `extension` and part `contacts`.
   *
   * @throws DamagedBlock if it is invalid or of another codec
   */
  static fromDescription(description: TrackDescription): ContactTrack {
    const { codec, performer } = description;
    if (codec !== CONTACT_CODEC)
      throw new DamagedBlock(`Unsupported codec of contacts ${String(codec)}, expected ${CONTACT_CODEC}.`);
    const timing = parseTiming(description, "extension");
    if (!Number.isInteger(performer) || Number(performer) < 0)
      throw new DamagedBlock("Invalid track of contacts: performer must be an index.");
    return new ContactTrack(timing, Number(performer));
  }
}

/** A decoded block: the feet that are planted in each frame, bit 0 for the left one. */
export class ContactBlock {
  constructor(readonly planted: Uint8Array) {}

  get frames(): number {
    return this.planted.length;
  }
}

/**
 * Decodes one block of `frames` frames.
 *
 * @throws DamagedBlock
 */
export function decodeContactBlock(data: Uint8Array, frames: number): ContactBlock {
  const planted = new Uint8Array(frames);
  const reader = new Leb128Reader(data);
  for (let foot = 0; foot < FEET.length; foot++) {
    let isPlanted = false;
    for (let begin = 0; begin < frames; ) {
      const length = reader.read();
      // only the first run, without contact, may be empty
      if (begin + length > frames || (length === 0 && (begin > 0 || isPlanted)))
        throw new DamagedBlock(`Invalid contacts: a run of ${length} frames at frame ${begin} of ${frames}.`);
      for (const end = begin + length; begin < end; begin++) if (isPlanted) planted[begin] |= 1 << foot;
      isPlanted = !isPlanted;
    }
  }
  if (reader.offset !== data.length)
    throw new DamagedBlock(`Invalid contacts: ${data.length} bytes, expected ${reader.offset} for ${frames} frames.`);
  return new ContactBlock(planted);
}
