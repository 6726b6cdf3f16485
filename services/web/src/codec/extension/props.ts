/** Props of a motion: their track and the decoder of its blocks (`proto/codec.md`, 2.21). */

import { isHand, MAX_LIMBS, MAX_PROPS } from "../../wire/limbs";
import { DamagedBlock } from "../errors";
import { Leb128Reader } from "../leb128";
import { parseTiming, Timing, type TrackDescription } from "../timing";

/** Part of a motion that tracks of props describe. */
export const PROP_PART = "props";

const PROP_CODEC = "bunraku.prop/1";
const MAX_STAGE_DISTANCE_M = 100;
const ABSENT = 0;
const ON_FLOOR = 1;
const IN_LIMB = 2;
const PLACE_BYTES = 12;

/** Where a prop is: in the hand of number `limb`, or, if that is null, on the floor at `place`: x, z and turn. */
export interface PropState {
  readonly limb: number | null;
  readonly place: readonly number[];
}

/** Timing of the props of a motion and their kinds; limbs count from those of the performer of this index. */
export class PropTrack extends Timing {
  constructor(
    timing: Timing,
    readonly performer: number,
    readonly kinds: readonly string[],
  ) {
    super(timing.fps, timing.frames, timing.blockFrames, timing.firstFrames);
  }

  /**
   * Returns the track of a Description's map of type `extension` and part `props`.
   *
   * @throws DamagedBlock if it is invalid or of another codec
   */
  static fromDescription(description: TrackDescription): PropTrack {
    const { codec, performer, kinds } = description;
    if (codec !== PROP_CODEC)
      throw new DamagedBlock(`Unsupported codec of props ${String(codec)}, expected ${PROP_CODEC}.`);
    const timing = parseTiming(description, "extension");
    if (!Number.isInteger(performer) || Number(performer) < 0)
      throw new DamagedBlock("Invalid track of props: performer must be an index.");
    const areTexts = Array.isArray(kinds) && kinds.every((kind) => typeof kind === "string");
    if (!areTexts || kinds.length < 1 || kinds.length > MAX_PROPS)
      throw new DamagedBlock(`Invalid track of props: kinds must be a list of 1 to ${MAX_PROPS} texts.`);
    return new PropTrack(timing, Number(performer), kinds as string[]);
  }
}

/** A decoded block: the state of each prop in each frame, null while it is not on the stage. */
export class PropBlock {
  constructor(readonly states: readonly (readonly (PropState | null)[])[]) {}

  get frames(): number {
    return this.states[0].length;
  }
}

/**
 * Decodes one block of `frames` frames.
 *
 * @throws DamagedBlock
 */
export function decodePropBlock(data: Uint8Array, propCount: number, frames: number): PropBlock {
  const reader = new Leb128Reader(data);
  const states = Array.from({ length: propCount }, () => {
    const each: (PropState | null)[] = [];
    while (each.length < frames) {
      const length = reader.read();
      if (length === 0 || length > frames - each.length)
        throw new DamagedBlock(`Invalid props: a run of ${length} frames at frame ${each.length} of ${frames}.`);
      const state = readState(data, reader.offset);
      reader.offset += state?.limb === null ? 1 + PLACE_BYTES : 1;
      for (let frame = 0; frame < length; frame++) each.push(state);
    }
    return each;
  });
  if (reader.offset !== data.length)
    throw new DamagedBlock(`Invalid props: ${data.length} bytes, expected ${reader.offset}.`);
  return new PropBlock(states);
}

function readState(data: Uint8Array, offset: number): PropState | null {
  const code = data[offset];
  if (code === ABSENT) return null;
  if (code === ON_FLOOR) {
    if (offset + 1 + PLACE_BYTES > data.length) throw new DamagedBlock("Invalid props: a place ends too early.");
    const view = new DataView(data.buffer, data.byteOffset + offset + 1, PLACE_BYTES);
    const place = [0, 4, 8].map((at) => view.getFloat32(at, true));
    const isOnStage = Math.abs(place[0]) <= MAX_STAGE_DISTANCE_M && Math.abs(place[1]) <= MAX_STAGE_DISTANCE_M;
    if (!isOnStage || !Number.isFinite(place[2])) throw new DamagedBlock("Invalid props: a place is not on the stage.");
    return { limb: null, place };
  }
  const limb = code - IN_LIMB;
  if (!(limb >= 0 && limb < MAX_LIMBS && isHand(limb))) throw new DamagedBlock(`Invalid props: no state ${code}.`);
  return { limb, place: [0, 0, 0] };
}
