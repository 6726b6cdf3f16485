/**
 * Scene tracks: camera and light beside a motion, and the decoder of their blocks (`proto/codec.md`, 2.14).
 *
 * A scene has seven values at an instant, world frame, metres: position 0-2; then of a camera its target 3-5 and its
 * vertical field of view 6 in radians; of a light its colour 3-5 in linear RGB and its intensity 6.
 */

import { SCENE_LAYOUT } from "./channel-layout";
import { decodeCoefficients } from "./coefficients";
import { DamagedBlock } from "./errors";
import { reconstruct, stepSize } from "./motion-decoder";
import { loadShippedPrior, type Prior } from "./prior";
import { type BitrateLevel, MAX_BLOCK_FRAMES, parseLadder, parseTiming, Timing, type TrackDescription } from "./timing";
import { cosineBasis } from "./transform";

export const SCENE_CODEC = "bunraku.scene/1";

/** Values of a camera or light at an instant. */
export const SCENE_VALUE_COUNT = 7;

/** Limit of the magnitude of all values of a track, so that no decoded value is infinite. */
const MAX_SCENE_VALUE = 1e6;

/** Weights with which the channels were multiplied before they were quantised. */
const CHANNEL_WEIGHTS = { camera: [1, 1, 1.15], light: [0.5, 1, 1] } as const;

export type SceneKind = keyof typeof CHANNEL_WEIGHTS;

const cosines = new Float64Array(MAX_BLOCK_FRAMES);

/** Timing of a scene, and constants of its coding. */
export class SceneTrack extends Timing {
  /**
   * @param timing frames and blocks
   * @param kind camera or light
   * @param full intensity that is coded as one; 1 for a camera
   * @param reference seven coded values that the blocks are relative to
   * @param ladder bitrate levels, lowest first
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
   * Returns the track of a Description's map of type `camera` or `light`.
   *
   * @throws DamagedBlock if it is invalid or of another codec
   */
  static fromDescription(description: TrackDescription): SceneTrack {
    const { type: kind, codec, full, reference } = description;
    if (kind !== "camera" && kind !== "light")
      throw new DamagedBlock(`Invalid scene track: type must be camera or light, not ${String(kind)}.`);
    if (codec !== SCENE_CODEC)
      throw new DamagedBlock(`Unsupported ${kind} codec ${String(codec)}, expected ${SCENE_CODEC}.`);
    const timing = parseTiming(description, kind);
    const isBounded = (value: unknown) => Number.isFinite(value) && Math.abs(Number(value)) <= MAX_SCENE_VALUE;
    if (!isBounded(full) || Number(full) <= 0)
      throw new DamagedBlock(`Invalid ${kind} track: full must be above zero and at most ${MAX_SCENE_VALUE}.`);
    if (!Array.isArray(reference) || reference.length !== SCENE_VALUE_COUNT || !reference.every(isBounded)) {
      throw new DamagedBlock(
        `Invalid ${kind} track: reference must have ${SCENE_VALUE_COUNT} numbers of at most ${MAX_SCENE_VALUE}.`,
      );
    }
    return new SceneTrack(timing, kind, Number(full), Float64Array.from(reference), parseLadder(description, kind));
  }
}

/** A decoded block. */
export class SceneBlock {
  /**
   * @param frames frames of the block
   * @param count frequencies of each value
   * @param values coefficients [value 7][count]
   */
  constructor(
    private readonly track: SceneTrack,
    readonly frames: number,
    readonly count: number,
    readonly values: Float64Array,
  ) {}

  /** Writes the seven values at `t`, in frames from the block's first, any real in [-1/2, frames - 1/2], into `out`. */
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
      // the Gudermannian function: 2 atan(exp(x)) without overflow
      out[6] = Math.PI / 2 + 2 * Math.atan(Math.tanh(out[6] / 2));
    } else {
      for (let number = 3; number < SCENE_VALUE_COUNT; number++) out[number] **= 2;
      out[6] *= full;
    }
  }
}

/**
 * Decodes one block of `track`. `prior` must be the one with which the block was encoded.
 *
 * @throws DamagedBlock
 */
export function decodeSceneBlock(track: SceneTrack, data: Uint8Array, prior: Prior = loadShippedPrior()): SceneBlock {
  const { frames, step, count, q } = decodeCoefficients(prior, data, track.blockFrames, track.fps, SCENE_LAYOUT);
  const size = stepSize(step, frames);
  // the other two axes of the last channel are zero
  const values = new Float64Array(SCENE_VALUE_COUNT * count);
  for (let number = 0, at = 0; number < SCENE_VALUE_COUNT; number++) {
    const weight = CHANNEL_WEIGHTS[track.kind][Math.floor(number / 3)];
    for (let k = 0; k < count; k++, at++) values[at] = (reconstruct(q[at]) * size) / weight;
  }
  return new SceneBlock(track, frames, count, values);
}
