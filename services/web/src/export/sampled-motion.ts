/** A motion sampled at every frame, as input of the writers. */

import type { Placement } from "../motion/placement";
import { copyPose, type Figure, JOINT_COUNT, type Pose, restPose } from "../motion/skeleton";
import type { MotionBlockStore } from "../playout/block-store";
import type { ExtensionBlockStore } from "../playout/extension-poses";
import type { SampledExtension } from "./export-skeleton";

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
}

/** Long task in short steps; yields the share done, 0..1. */
export type IncrementalTask<T> = Generator<number, T>;

/** Frames per step. */
export const FRAMES_PER_STEP = 32;

/**
 * Sample the first `frames` frames of a store, and of the extension's, at the motion's frame rate. All their blocks must
 * be loaded.
 */
export function* sampleMotion(
  store: MotionBlockStore,
  frames = store.track.frames,
  extensionStore: ExtensionBlockStore | null = null,
): IncrementalTask<SampledMotion> {
  const { figure, placement: place, fps } = store.track;
  const roots = new Float64Array(frames * 3),
    rotations = new Float64Array(frames * JOINT_COUNT * 4);
  const pose = restPose();
  const size = (extensionStore?.track.extension.kinds.length ?? 0) * 3;
  const values = new Float64Array(frames * size);
  for (let frame = 0; frame < frames; frame++) {
    if (!store.poseAt((frame * 1e6) / fps, false, pose))
      throw new Error(`Export failed: the block of frame ${frame} is not loaded.`);
    roots.set(pose.root, frame * 3);
    rotations.set(pose.rotations, frame * JOINT_COUNT * 4);
    extensionStore?.valuesAt(
      (frame * 1e6) / fps,
      false,
      store.track.durationUs,
      values.subarray(frame * size, (frame + 1) * size),
    );
    if (frame % FRAMES_PER_STEP === 0) yield frame / frames;
  }
  const extension = extensionStore && { extension: extensionStore.track.extension, values };
  return { figure, placement: place, fps, frames, roots, rotations, extension };
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

/** Return the values [E][3] of the extension in a frame of `motion`, or null if it has none. */
export function extensionValuesAt({ extension }: SampledMotion, frame: number): Float64Array | null {
  if (!extension) return null;
  const size = extension.extension.kinds.length * 3;
  return extension.values.subarray(frame * size, (frame + 1) * size);
}
