/** A motion sampled at every frame, as input of the writers. */

import type { ExtensionContent, ExtensionPart } from "../codec/extension/track";
import type { BodyExtension } from "../motion/extension";
import { EXPRESSIONS, type Face, faceExpressions } from "../motion/face";
import { chainJoints, type Hands } from "../motion/hands";
import type { Placement } from "../motion/placement";
import { copyPose, type Figure, JOINT_COUNT, type Pose, restPose } from "../motion/skeleton";
import type { MotionBlockStore } from "../playout/block-store";
import type { ExtensionBlockStore } from "../playout/extension-values";
import type { FrameValues } from "./export-skeleton";

/** Body extension of a sampled motion: values [frame][E][3], radians. */
export interface SampledExtension {
  readonly extension: BodyExtension;
  readonly values: Float64Array;
}

/** Fingers of a sampled motion: rotation vectors [frame][E][3] of their joints, radians. */
export interface SampledHands {
  readonly hands: Hands;
  readonly values: Float64Array;
}

/** Face of a sampled motion: weights [frame][`EXPRESSIONS`]. */
export interface SampledFace {
  readonly face: Face;
  readonly weights: Float64Array;
}

/**
 * `frames` poses of `figure` at `fps`: root positions [frame][3] in metres, local rotations [frame][joint 18][w x y z].
 * They are relative to the motion's own stage, which has a `placement` on the shared stage.
 */
export interface SampledMotion {
  figure: Figure;
  placement: Placement;
  fps: number;
  frames: number;
  roots: Float64Array;
  rotations: Float64Array;
  extension?: SampledExtension | null;
  hands?: SampledHands | null;
  face?: SampledFace | null;
}

/** Blocks of a performer's extensions. */
export type ExtensionStores = Partial<Record<ExtensionPart, ExtensionBlockStore>>;

/** Long task in short steps; yields the share done, 0..1. */
export type IncrementalTask<T> = Generator<number, T>;

/** Frames per step. */
export const FRAMES_PER_STEP = 32;

/**
 * Sample the first `frames` frames of a store, and of those of its extensions, at the motion's frame rate. All their
 * blocks must be loaded.
 */
export function* sampleMotion(
  store: MotionBlockStore,
  frames = store.track.frames,
  extensions: ExtensionStores = {},
): IncrementalTask<SampledMotion> {
  const { figure, placement: place, fps, durationUs } = store.track;
  const roots = new Float64Array(frames * 3),
    rotations = new Float64Array(frames * JOINT_COUNT * 4);
  const pose = restPose();
  const samples = Object.values(extensions).map((extension) => new ExtensionSamples(extension, frames));
  for (let frame = 0; frame < frames; frame++) {
    const position = (frame * 1e6) / fps;
    if (!store.poseAt(position, false, pose))
      throw new Error(`Export failed: the block of frame ${frame} is not loaded.`);
    roots.set(pose.root, frame * 3);
    rotations.set(pose.rotations, frame * JOINT_COUNT * 4);
    for (const extension of samples) extension.sample(frame, position, durationUs);
    if (frame % FRAMES_PER_STEP === 0) yield frame / frames;
  }
  const motion: SampledMotion = { figure, placement: place, fps, frames, roots, rotations };
  for (const { content, values } of samples) {
    if (content.part === "body") motion.extension = { extension: content.body, values };
    else if (content.part === "fingers") motion.hands = { hands: content.hands, values };
    else motion.face = { face: content.face, weights: toWeights(content.face, values, frames) };
  }
  return motion;
}

/** Values of each frame of an extension. */
class ExtensionSamples {
  readonly content: ExtensionContent;
  readonly values: Float64Array;
  private readonly size: number;

  constructor(
    private readonly store: ExtensionBlockStore,
    frames: number,
  ) {
    this.content = store.track.content;
    this.size = store.track.layout.count * 3;
    this.values = new Float64Array(frames * this.size);
  }

  sample(frame: number, position: number, duration: number): void {
    this.store.valuesAt(position, false, duration, frameOf(this.values, frame, this.size));
  }
}

/** Return the weights [frame][`EXPRESSIONS`] for the values of a face's channels. */
function toWeights(face: Face, values: Float64Array, frames: number): Float64Array {
  const weights = new Float64Array(frames * EXPRESSIONS.length);
  for (let frame = 0; frame < frames; frame++)
    faceExpressions(face, frameOf(values, frame, values.length / frames), frameOf(weights, frame, EXPRESSIONS.length));
  return weights;
}

function frameOf(values: Float64Array, frame: number, size: number): Float64Array {
  return values.subarray(frame * size, (frame + 1) * size);
}

/** Write a frame of `motion` into `out` and return it. */
export function poseAt({ roots, rotations }: SampledMotion, frame: number, out: Pose): Pose {
  const joints = JOINT_COUNT * 4;
  copyPose(
    {
      root: roots.subarray(frame * 3, frame * 3 + 3),
      rotations: rotations.subarray(frame * joints, (frame + 1) * joints),
    },
    out,
  );
  return out;
}

/** Return the values of extension and fingers in a frame of `motion`. */
export function frameValuesAt({ extension, hands }: SampledMotion, frame: number): FrameValues {
  return {
    extension: extension ? frameOf(extension.values, frame, extension.extension.kinds.length * 3) : null,
    hands: hands ? frameOf(hands.values, frame, chainJoints(hands.hands).length * 3) : null,
  };
}

/** Return the weights of `EXPRESSIONS` in a frame of `motion`, or null if it has no face. */
export function faceWeightsAt({ face }: SampledMotion, frame: number): Float64Array | null {
  return face ? frameOf(face.weights, frame, EXPRESSIONS.length) : null;
}
