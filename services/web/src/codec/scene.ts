/**
 * Camera and light, tracks beside the motion in the motion's own time (`proto/SPEC.md`, Tracks `camera` and `light`).
 *
 * A scene has seven numbers at an instant, world frame, metres: position 0-2; then, of a camera, the point gazed at 3-5 and the
 * vertical field of view 6 in radians; of a light, the colour 3-5 in linear RGB and the intensity 6.
 */

import { decodeCoefficients, MAX_BLOCK_FRAMES, SCENE_CHANNEL_COUNT } from "./coefficients";
import { DamagedBlock } from "./errors";
import { reconstruct, stepSize } from "./motion-decoder";
import { loadShippedPrior, type Prior } from "./prior";
import { type BitrateLevel, parseLadder, parseTiming, Timing, type TrackDescription } from "./timing";
import { cosineBasis } from "./transform";

export const SCENE_CODEC = "bunraku.scene/1";

/** Numbers of a camera or a light at an instant. */
export const SCENE_VALUE_COUNT = 7;

/** No number of a track is larger, so that nothing decoded is beyond all numbers. */
const MAX_SCENE_VALUE = 1e6;

/** What each channel was multiplied with before it was quantised. */
const CHANNEL_WEIGHTS = { camera: [1, 1, 1.15], light: [0.5, 1, 1] } as const;

export type SceneKind = keyof typeof CHANNEL_WEIGHTS;

const cosines = new Float64Array(MAX_BLOCK_FRAMES);

/** Constants of a camera's or a light's blocks, as in the Description. */
export class SceneTrack extends Timing {
  /**
   * @param timing its frames and blocks
   * @param kind what it is
   * @param full the intensity that counts as one; 1 for a camera
   * @param reference seven coded numbers that the blocks are relative to
   * @param ladder what each rate costs and keeps, from the lowest to the highest
   */
  constructor(
    timing: Timing,
    readonly kind: SceneKind,
    readonly full: number,
    readonly reference: Float64Array,
    readonly ladder: readonly BitrateLevel[] = [],
  ) {
    super(timing.fps, timing.frames, timing.blockFrames, timing.firstFrames);
  }

  /**
   * The track that a Description's map of type `camera` or `light` tells of.
   *
   * @throws DamagedBlock where it tells of none that can be played here
   */
  static fromDescription(description: TrackDescription): SceneTrack {
    const { type: kind, codec, full, reference } = description;
    if (kind !== "camera" && kind !== "light")
      throw new DamagedBlock(`a scene is a camera or a light, not ${String(kind)}`);
    if (codec !== SCENE_CODEC)
      throw new DamagedBlock(`${kind} is of codec ${String(codec)}; this client reads ${SCENE_CODEC}`);
    const timing = parseTiming(description, kind);
    const small = (value: unknown) => Number.isFinite(value) && Math.abs(Number(value)) <= MAX_SCENE_VALUE;
    if (!small(full) || Number(full) <= 0)
      throw new DamagedBlock(`${kind} needs full, a number above zero and at most ${MAX_SCENE_VALUE}`);
    if (!Array.isArray(reference) || reference.length !== SCENE_VALUE_COUNT || !reference.every(small)) {
      throw new DamagedBlock(
        `${kind} needs a reference of ${SCENE_VALUE_COUNT} numbers, none beyond ${MAX_SCENE_VALUE}`,
      );
    }
    return new SceneTrack(timing, kind, Number(full), Float64Array.from(reference), parseLadder(description, kind));
  }
}

/** A decoded block. */
export class SceneBlock {
  /**
   * @param frames frames of the block
   * @param count frequencies of each number
   * @param values coefficients [number 7][count]
   */
  constructor(
    private readonly track: SceneTrack,
    readonly frames: number,
    readonly count: number,
    readonly values: Float64Array,
  ) {}

  /** The seven numbers at `t`, in frames from the block's first, any real in [-1/2, frames - 1/2], written into `out`. */
  valuesAt(t: number, out: Float64Array): void {
    const { count, values } = this;
    const { kind, full, reference } = this.track;
    cosineBasis(cosines, this.frames, count, t);
    for (let number = 0, at = 0; number < SCENE_VALUE_COUNT; number++) {
      let sum = 0;
      for (let k = 0; k < count; k++) sum += values[at++] * cosines[k];
      out[number] = sum + reference[number];
    }
    if (kind === "camera") {
      // the Gudermannian function: 2 atan(exp(x)) without the overflow
      out[6] = Math.PI / 2 + 2 * Math.atan(Math.tanh(out[6] / 2));
    } else {
      for (let number = 3; number < SCENE_VALUE_COUNT; number++) out[number] **= 2;
      out[6] *= full;
    }
  }
}

/**
 * Decodes one block of `track`, with the shipped prior unless another is given.
 *
 * @throws DamagedBlock on what cannot be one
 */
export function decodeSceneBlock(track: SceneTrack, data: Uint8Array, prior: Prior = loadShippedPrior()): SceneBlock {
  const { frames, step, count, q } = decodeCoefficients(prior, data, track.blockFrames, track.fps, SCENE_CHANNEL_COUNT);
  const size = stepSize(step, frames);
  // the last channel's other two axes are not seen
  const values = new Float64Array(SCENE_VALUE_COUNT * count);
  for (let number = 0, at = 0; number < SCENE_VALUE_COUNT; number++) {
    const weight = CHANNEL_WEIGHTS[track.kind][Math.floor(number / 3)];
    for (let k = 0; k < count; k++, at++) values[at] = (reconstruct(q[at]) * size) / weight;
  }
  return new SceneBlock(track, frames, count, values);
}
