/** What the blocks of one motion have in common: sent once, in the Description (`proto/SPEC.md`, Track `motion`). */

import type { Figure } from "../motion/skeleton";
import { unpackDancer } from "./dancer";
import { DamagedBlock } from "./errors";
import { type Described, type Rate, readRates, readTiming, Timing } from "./timing";
import { channelWeights, type Weights } from "./weights";

export const CODEC = "bunraku.motion/2";

/** Radians in one unit of a block's turn of the root. */
export const TURN_UNIT = 0.1;

/** Constants of a motion's blocks, as in the Description. */
export class MotionTrack extends Timing {
  readonly weights: Weights;

  /**
   * @param fps frames per second
   * @param frames frames of the whole motion
   * @param blockFrames frames of every block but the first and perhaps the last
   * @param firstFrames frames of the first block
   * @param figure the dancer
   * @param reference the joints' reference rotations (72)
   * @param rates what each rate costs and keeps, from the lowest to the highest
   * @param front where the dance faces over its length, radians about y from z towards x
   */
  constructor(
    fps: number,
    frames: number,
    blockFrames: number,
    firstFrames: number,
    readonly figure: Figure,
    readonly reference: Float64Array,
    readonly rates: readonly Rate[] = [],
    readonly front = 0,
  ) {
    super(fps, frames, blockFrames, firstFrames);
    this.weights = channelWeights(figure);
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
    const { figure, reference } = unpackDancer(dancer);
    return new MotionTrack(
      fps, frames, blockFrames, firstFrames, figure, reference, rates,
      Number.isFinite(front) ? Number(front) : 0,
    );
  }
}
