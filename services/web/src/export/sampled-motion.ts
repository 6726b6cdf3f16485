/** A whole motion frame by frame, as the writers of files take it. */

import type { Placement } from "../motion/placement";
import { copyPose, type Figure, JOINT_COUNT, type Pose, restPose } from "../motion/skeleton";
import type { MotionBlockStore } from "../playout/block-store";

/**
 * `frames` poses of `figure`, `fps` a second: the root's places [frame][3] in metres, local rotations [frame][joint 18][w x y z].
 * They are told about the middle of a stage of the dance's own, which stands at `place` on the stage that all dancers share.
 */
export interface SampledMotion {
  figure: Figure;
  placement: Placement;
  fps: number;
  frames: number;
  roots: Float64Array;
  rotations: Float64Array;
}

/** Long work in short steps: it says between them which share of it is done, 0..1. */
export type IncrementalTask<T> = Generator<number, T>;

/** Frames of work between two words of how far it is. */
export const FRAMES_PER_STEP = 32;

/** The first `frames` of what `store` holds, at its own frame rate. Every block of them must be there. */
export function* sampleMotion(store: MotionBlockStore, frames = store.track.frames): IncrementalTask<SampledMotion> {
  const { figure, placement: place, fps } = store.track;
  const roots = new Float64Array(frames * 3),
    rotations = new Float64Array(frames * JOINT_COUNT * 4);
  const pose = restPose();
  for (let frame = 0; frame < frames; frame++) {
    if (!store.poseAt((frame * 1e6) / fps, false, pose)) throw new Error(`the block of frame ${frame} is not here`);
    roots.set(pose.root, frame * 3);
    rotations.set(pose.rotations, frame * JOINT_COUNT * 4);
    if (frame % FRAMES_PER_STEP === 0) yield frame / frames;
  }
  return { figure, placement: place, fps, frames, roots, rotations };
}

/** Frame `frame` of `dance`, written into `out` and returned. */
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
