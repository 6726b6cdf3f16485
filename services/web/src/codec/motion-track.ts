/** What the blocks of one motion have in common: sent once, in the Description (`proto/SPEC.md`, Track `motion`). */

import { type Placement, STAGE_CENTRE } from "../motion/placement";
import { multiply } from "../motion/rotation";
import type { Figure } from "../motion/skeleton";
import { fromCoordinateAxis } from "../motion/vector";
import { type ChannelWeights, channelWeights } from "./channel-weights";
import { DamagedBlock } from "./errors";
import { type SkeletonDescription, unpackSkeletonDescription } from "./skeleton-description";
import { type BitrateLevel, parseLadder, parseTiming, Timing, type TrackDescription } from "./timing";

export const MOTION_CODEC = "bunraku.motion/2";

/** Headings of a block's root in a whole turn about y. */
export const HEADING_COUNT = 64;

/** Metres from the middle of the stage along x and z. */
const MAX_PLACEMENT_M = 100;

/** Constants of a motion's blocks, as in the Description. */
export class MotionTrack extends Timing {
  readonly weights: ChannelWeights;

  /**
   * @param fps frames per second
   * @param frames frames of the whole motion
   * @param blockFrames frames of every block but the first and perhaps the last
   * @param firstFrames frames of the first block
   * @param skeleton limb lengths, and what rotations are told from
   * @param ladder what each rate costs and keeps, from the lowest to the highest
   * @param front where the dance faces over its length before it is turned by `place`, radians about y from z towards x
   * @param placement where it stands
   */
  constructor(
    fps: number,
    frames: number,
    blockFrames: number,
    firstFrames: number,
    readonly skeleton: SkeletonDescription,
    readonly ladder: readonly BitrateLevel[] = [],
    readonly front = 0,
    readonly placement: Placement = STAGE_CENTRE,
  ) {
    super(fps, frames, blockFrames, firstFrames);
    this.weights = channelWeights(skeleton.figure, skeleton.reference);
  }

  /** The dancer's, as it is decoded. */
  get figure(): Figure {
    return this.skeleton.figure;
  }

  /** What a block of this `heading` tells rotations from (72). */
  referenceRotations(heading: number): Float64Array {
    const rotations = this.skeleton.reference.slice();
    const turn = new Float64Array(4);
    fromCoordinateAxis(turn, 0, 1, (heading * 2 * Math.PI) / HEADING_COUNT);
    multiply(rotations, 0, turn, 0, rotations, 0);
    return rotations;
  }

  /**
   * The track that a Description's map of type `motion` tells of.
   *
   * @throws DamagedBlock where it tells of none that can be played here
   */
  static fromDescription(description: TrackDescription): MotionTrack {
    const { codec, dancer, front } = description;
    if (codec !== MOTION_CODEC)
      throw new DamagedBlock(`motion is of codec ${String(codec)}; this client reads ${MOTION_CODEC}`);
    const { fps, frames, blockFrames, firstFrames } = parseTiming(description, "motion");
    if (!(dancer instanceof Uint8Array)) throw new DamagedBlock("motion needs a dancer, bytes");
    const rates = parseLadder(description, "motion");
    return new MotionTrack(
      fps,
      frames,
      blockFrames,
      firstFrames,
      unpackSkeletonDescription(dancer),
      rates,
      Number.isFinite(front) ? Number(front) : 0,
      parsePlacement(description.place),
    );
  }
}

/**
 * Where the dancer of a track dances, from its map's `place`.
 *
 * @throws DamagedBlock
 */
function parsePlacement(place: unknown): Placement {
  if (place === undefined) return STAGE_CENTRE;
  if (!Array.isArray(place) || place.length !== 3 || !place.every(Number.isFinite))
    throw new DamagedBlock("motion needs a place of three numbers");
  const [x, z, turn] = place as [number, number, number];
  if (Math.abs(x) > MAX_PLACEMENT_M || Math.abs(z) > MAX_PLACEMENT_M)
    throw new DamagedBlock(`motion needs a place within ${MAX_PLACEMENT_M} metres`);
  return { x, z, turn };
}
