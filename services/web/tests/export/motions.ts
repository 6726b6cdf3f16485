/** Motions for export tests, and measurement of the error of parsed files. */
import { type AnimationClip, AnimationMixer, type Object3D, Vector3 } from "three";
import { expect } from "vitest";
import { MotionTrack } from "../../src/codec/motion-track";
import {
  frameValuesAt,
  type IncrementalTask,
  poseAt,
  type SampledMotion,
  sampleMotion,
} from "../../src/export/sampled-motion";
import { createExtendedPose, extendPose } from "../../src/motion/extension";
import { EXPRESSIONS } from "../../src/motion/face";
import { chainJoints, HANIM_NAMES, poseHands } from "../../src/motion/hands";
import { applyPlacement, type Placement, STAGE_CENTRE } from "../../src/motion/placement";
import { fromRotationVector } from "../../src/motion/rotation";
import {
  createWorldTransforms,
  type Figure,
  JOINT_COUNT,
  JOINTS,
  restPose,
  worldTransforms,
} from "../../src/motion/skeleton";
import { MotionBlockStore } from "../../src/playout/block-store";
import { faceOf } from "../avatar/face/faces";
import { extensionVectors, goldenBody } from "../golden-extensions";
import { type BlockVectors, goldenDescription } from "../golden-motion";
import { decodeBase64, loadVectors } from "../golden-vectors";
import { createHands } from "../motion/hand-poses";
import { createStandardFigure } from "../stage/puppet/figures";

/**
 * Create forty frames in which every joint rotates and the root travels; with `straight` the sacroiliac does not
 * rotate.
 */
export function turningMotion({
  straight = false,
  figure = createStandardFigure(),
  place = STAGE_CENTRE,
}: {
  straight?: boolean;
  figure?: Figure;
  place?: Placement;
} = {}): SampledMotion {
  const frames = 40;
  const motion = {
    figure,
    placement: place,
    fps: 30,
    frames,
    roots: new Float64Array(frames * 3),
    rotations: new Float64Array(frames * JOINT_COUNT * 4),
  };
  for (let frame = 0; frame < frames; frame++) {
    motion.roots.set([0.02 * frame, 0.9 + 0.1 * Math.sin(frame / 5), -0.01 * frame], frame * 3);
    for (let joint = 0; joint < JOINT_COUNT; joint++) {
      const size = straight && joint === 1 ? 0 : 1;
      const [x, y, z] = [0.3, 0.5, 0.7].map((speed, axis) => size * 1.1 * Math.sin(speed * (frame / 4) + joint + axis));
      fromRotationVector(motion.rotations, (frame * JOINT_COUNT + joint) * 4, x, joint === 0 ? frame / 6 : y, z);
    }
  }
  return motion;
}

/** Create a turning motion of the figure of golden extension `track`, whose trunk, neck and shoulders move too. */
export function extendedMotion(track: number): SampledMotion {
  const golden = extensionVectors();
  const vector = golden.poses.find((pose) => pose.track === track) as (typeof golden.poses)[number];
  const extension = goldenBody(golden.tracks[track]);
  const figure = { offsets: Float64Array.from(vector.offsets), tips: createStandardFigure().tips };
  const motion = turningMotion({ straight: true, figure });
  const size = extension.kinds.length * 3;
  const values = Float64Array.from(
    { length: motion.frames * size },
    (_, at) => 0.15 * Math.sin(Math.floor(at / size) / 6 + (at % size)),
  );
  return { ...motion, extension: { extension, values } };
}

/** Return a motion with fingers of these numbers of joints, all of which move. */
export function withHands(motion: SampledMotion, count: number | readonly number[] = 3): SampledMotion {
  const hands = createHands(count);
  const size = chainJoints(hands).length * 3;
  const values = Float64Array.from(
    { length: motion.frames * size },
    (_, at) => 0.7 * Math.sin(Math.floor(at / size) / 5 + (at % size)),
  );
  return { ...motion, hands: { hands, values } };
}

/** Return a motion with a face that knows these expressions, whose weights rise and fall. */
export function withFace(motion: SampledMotion, ...names: string[]): SampledMotion {
  const { face } = faceOf(Object.fromEntries(names.map((name) => [name, 1])));
  const weights = new Float64Array(motion.frames * EXPRESSIONS.length);
  for (let frame = 0; frame < motion.frames; frame++)
    names.forEach((name, at) => {
      weights[frame * EXPRESSIONS.length + EXPRESSIONS.indexOf(name)] = 0.5 + 0.5 * Math.sin(frame / 4 + at);
    });
  return { ...motion, face: { face, weights } };
}

/** Return the world positions of the joints of the fingers in a frame, metres, by H-Anim name. */
export function fingerPositions(motion: SampledMotion, frame: number): Map<string, Vector3> {
  const { hands } = motion.hands as NonNullable<SampledMotion["hands"]>;
  const joints = chainJoints(hands);
  const pose = applyPlacement(poseAt(motion, frame, restPose()), motion.placement);
  const world = worldTransforms(motion.figure, pose, createWorldTransforms());
  const { extension, hands: values } = frameValuesAt(motion, frame);
  const extended =
    motion.extension && extension
      ? extendPose(motion.figure, world, extension, createExtendedPose(motion.extension.extension))
      : world;
  const { positions } = poseHands({ hands, values: values as Float64Array }, extended, {
    positions: new Float64Array(joints.length * 3),
    orientations: new Float64Array(joints.length * 4),
  });
  return new Map(
    joints.map(([chain, place], joint) => [HANIM_NAMES[chain][place], new Vector3().fromArray(positions, joint * 3)]),
  );
}

/** Return a golden motion at the best bitrate level of each block, at a placement. */
export function goldenMotion(motionIndex = 0, { x, z, turn }: Placement = STAGE_CENTRE): SampledMotion {
  return runToCompletion(sampleMotion(goldenStore(motionIndex, { x, z, turn })));
}

/** Return a store with its blocks. */
export function goldenStore(motionIndex = 0, { x, z, turn }: Placement = STAGE_CENTRE): MotionBlockStore {
  const store = new MotionBlockStore(
    MotionTrack.fromDescription({ ...goldenDescription(motionIndex), place: [x, z, turn] }),
  );
  const blocks = loadVectors<BlockVectors>("blocks").valid.filter(({ track }) => track === motionIndex);
  // The first motion has two bitrate levels of the first block.
  const indices = motionIndex === 0 ? [0, 0, 1, 2] : [0, 1, 2];
  indices.forEach((index, blockIndex) => store.put(index, blockIndex, decodeBase64(blocks[blockIndex].block)));
  return store;
}

/** Run a task to completion and check that its progress rises. */
export function runToCompletion<T>(work: IncrementalTask<T>): T {
  for (let last = 0; ; ) {
    const { done, value } = work.next();
    if (done) return value;
    expect(value).toBeGreaterThanOrEqual(last);
    expect(value).toBeLessThanOrEqual(1);
    last = value;
  }
}

/** Join the parts of a file. */
export async function joinParts(parts: Uint8Array<ArrayBuffer>[]): Promise<ArrayBuffer> {
  return new Blob(parts).arrayBuffer();
}

/** Return the world positions of the joints in a frame (54) on the shared stage, in metres, as an extension moves them. */
export function jointPositions(motion: SampledMotion, frame: number): Float64Array {
  const pose = applyPlacement(poseAt(motion, frame, restPose()), motion.placement);
  const world = worldTransforms(motion.figure, pose, createWorldTransforms());
  const { extension: values } = frameValuesAt(motion, frame);
  if (!motion.extension || !values) return world.positions.slice();
  return extendPose(motion.figure, world, values, createExtendedPose(motion.extension.extension)).positions.slice();
}

/**
 * Play `clip` on `root` frame by frame; return the largest distance of a joint, found by name, from the motion's, in
 * metres.
 */
export function maxJointError(
  motion: SampledMotion,
  root: Object3D,
  clip: AnimationClip,
  unit = 1,
  find = (name: string) => root.getObjectByName(name),
): number {
  const mixer = new AnimationMixer(root);
  mixer.clipAction(clip).play();
  const at = new Vector3();
  let maxError = 0;
  for (let frame = 0; frame < motion.frames; frame++) {
    // The last frame is the end of the loop, where it restarts.
    mixer.setTime(Math.min(frame / motion.fps, clip.duration - 1e-6));
    root.updateMatrixWorld(true);
    const places = jointPositions(motion, frame);
    // an extension has its own spine
    for (const name of JOINTS.filter((one) => one !== "vl5" || !motion.extension)) {
      const joint = find(name);
      if (!joint) throw new Error(`The file has no joint ${name}.`);
      at.setFromMatrixPosition(joint.matrixWorld).multiplyScalar(unit);
      const k = JOINTS.indexOf(name) * 3;
      maxError = Math.max(maxError, Math.hypot(at.x - places[k], at.y - places[k + 1], at.z - places[k + 2]));
    }
    for (const [name, place] of motion.hands ? fingerPositions(motion, frame) : []) {
      const joint = find(name);
      if (!joint) throw new Error(`The file has no joint ${name}.`);
      maxError = Math.max(maxError, at.setFromMatrixPosition(joint.matrixWorld).multiplyScalar(unit).distanceTo(place));
    }
  }
  return maxError;
}
