/** What the blocks of one motion have in common: sent once, in the Description (`proto/SPEC.md`, Track `motion`). */

import { MIDDLE, type Place } from "../motion/performer";
import { multiply } from "../motion/rotation";
import type { Figure } from "../motion/skeleton";
import { aboutAxis } from "../motion/vector";
import { type Dancer, unpackDancer } from "./dancer";
import { DamagedBlock } from "./errors";
import { type Described, type Rate, readRates, readTiming, Timing } from "./timing";
import { channelWeights, type Weights } from "./weights";

export const CODEC = "bunraku.motion/2";

/** Headings of a block's root in a whole turn about y. */
export const HEADINGS = 64;

/** Metres from the middle of the stage along x and z. */
const FARTHEST = 100;

/** Constants of a motion's blocks, as in the Description. */
export class MotionTrack extends Timing {
  readonly weights: Weights;

  /**
   * @param fps frames per second
   * @param frames frames of the whole motion
   * @param blockFrames frames of every block but the first and perhaps the last
   * @param firstFrames frames of the first block
   * @param dancer limb lengths, and what rotations are told from
   * @param rates what each rate costs and keeps, from the lowest to the highest
   * @param front where the dance faces over its length before it is turned by `place`, radians about y from z towards x
   * @param place where it stands
   */
  constructor(
    fps: number,
    frames: number,
    blockFrames: number,
    firstFrames: number,
    readonly dancer: Dancer,
    readonly rates: readonly Rate[] = [],
    readonly front = 0,
    readonly place: Place = MIDDLE,
  ) {
    super(fps, frames, blockFrames, firstFrames);
    this.weights = channelWeights(dancer.figure, dancer.reference);
  }

  /** The dancer's, as it is decoded. */
  get figure(): Figure {
    return this.dancer.figure;
  }

  /** What a block of this `heading` tells rotations from (72). */
  referenceRotations(heading: number): Float64Array {
    const rotations = this.dancer.reference.slice();
    const turn = new Float64Array(4);
    aboutAxis(turn, 0, 1, (heading * 2 * Math.PI) / HEADINGS);
    multiply(rotations, 0, turn, 0, rotations, 0);
    return rotations;
  }

  /**
   * The track that a Description's map of type `motion` tells of.
   *
   * @throws DamagedBlock where it tells of none that can be played here
   */
  static fromDescription(map: Described): MotionTrack {
    const { codec, dancer, front } = map;
    if (codec !== CODEC) throw new DamagedBlock(`motion is of codec ${String(codec)}; this client reads ${CODEC}`);
    const { fps, frames, blockFrames, firstFrames } = readTiming(map, "motion");
    if (!(dancer instanceof Uint8Array)) throw new DamagedBlock("motion needs a dancer, bytes");
    const rates = readRates(map, "motion");
    return new MotionTrack(
      fps, frames, blockFrames, firstFrames, unpackDancer(dancer), rates,
      Number.isFinite(front) ? Number(front) : 0, readPlace(map.place),
    );
  }
}

/**
 * Where the dancer of a track dances, from its map's `place`.
 *
 * @throws DamagedBlock
 */
function readPlace(place: unknown): Place {
  if (place === undefined) return MIDDLE;
  if (!Array.isArray(place) || place.length !== 3 || !place.every(Number.isFinite)) throw new DamagedBlock("motion needs a place of three numbers");
  const [x, z, turn] = place as [number, number, number];
  if (Math.abs(x) > FARTHEST || Math.abs(z) > FARTHEST) throw new DamagedBlock(`motion needs a place within ${FARTHEST} metres`);
  return { x, z, turn };
}
