/** Motion track: what the blocks of a motion share, sent once in the Description (`proto/messages.md`, 3.2). */

import { type Placement, STAGE_CENTRE } from "../motion/placement";
import { multiply } from "../motion/rotation";
import type { Figure } from "../motion/skeleton";
import { fromCoordinateAxis } from "../motion/vector";
import { type ChannelWeights, channelWeights } from "./channel-weights";
import { DamagedBlock } from "./errors";
import { type SkeletonDescription, unpackSkeletonDescription } from "./skeleton-description";
import { type BitrateLevel, parseLadder, parseTiming, Timing, type TrackDescription } from "./timing";

export const MOTION_CODEC = "bunraku.motion/2";

/** Headings of a block's root in a full turn about y. */
export const HEADING_COUNT = 64;

/** Limit of the distance from the centre of the stage along x and z, metres. */
const MAX_PLACEMENT_M = 100;

/** Timing and skeleton of a motion, and the weights of its channels. */
export class MotionTrack extends Timing {
  readonly weights: ChannelWeights;

  /**
   * @param fps frames per second
   * @param frames frames of the whole motion
   * @param blockFrames frames of all blocks but the first; the last may be shorter
   * @param firstFrames frames of the first block
   * @param skeleton bone lengths and reference pose
   * @param ladder bitrate levels, lowest first
   * @param front mean direction that the motion faces before `placement`, radians about y from z towards x
   * @param placement place on the stage
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

  /** Figure of the skeleton, as it is decoded. */
  get figure(): Figure {
    return this.skeleton.figure;
  }

  /** Returns the quaternions (72) that the rotations of a block with this heading are relative to. */
  referenceRotations(heading: number): Float64Array {
    const rotations = this.skeleton.reference.slice();
    const turn = new Float64Array(4);
    fromCoordinateAxis(turn, 0, 1, (heading * 2 * Math.PI) / HEADING_COUNT);
    multiply(rotations, 0, turn, 0, rotations, 0);
    return rotations;
  }

  /**
   * Returns the track of a Description's map of type `motion`.
   *
   * @throws DamagedBlock if it is invalid or of another codec
   */
  static fromDescription(description: TrackDescription): MotionTrack {
    const { codec, dancer, front } = description;
    if (codec !== MOTION_CODEC)
      throw new DamagedBlock(`Unsupported motion codec ${String(codec)}, expected ${MOTION_CODEC}.`);
    const { fps, frames, blockFrames, firstFrames } = parseTiming(description, "motion");
    if (!(dancer instanceof Uint8Array))
      throw new DamagedBlock("Invalid motion track: dancer (the skeleton description) must be bytes.");
    const ladder = parseLadder(description, "motion");
    return new MotionTrack(
      fps,
      frames,
      blockFrames,
      firstFrames,
      unpackSkeletonDescription(dancer),
      ladder,
      Number.isFinite(front) ? Number(front) : 0,
      parsePlacement(description.place),
    );
  }
}

/**
 * Returns the placement in a map's `place`.
 *
 * @throws DamagedBlock
 */
function parsePlacement(place: unknown): Placement {
  if (place === undefined) return STAGE_CENTRE;
  if (!Array.isArray(place) || place.length !== 3 || !place.every(Number.isFinite))
    throw new DamagedBlock("Invalid motion track: place must have three numbers.");
  const [x, z, turn] = place as [number, number, number];
  if (Math.abs(x) > MAX_PLACEMENT_M || Math.abs(z) > MAX_PLACEMENT_M)
    throw new DamagedBlock(`Invalid motion track: place must be within ${MAX_PLACEMENT_M} metres of the centre.`);
  return { x, z, turn };
}
