/** Dances to be written, and how far what was read of them is from what they are. */
import { type AnimationClip, AnimationMixer, type Object3D, Vector3 } from "three";
import { expect } from "vitest";
import { MotionTrack } from "../../src/codec/motion-track";
import { type IncrementalTask, poseAt, type SampledMotion, sampleMotion } from "../../src/export/sampled-motion";
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
import { type BlockVectors, goldenDescription } from "../golden-motion";
import { decodeBase64, loadVectors } from "../golden-vectors";
import { createStandardFigure } from "../stage/puppet/figures";

/** Forty frames in which every joint turns, each in its own way, and the root goes off; the sacroiliac stays `straight` or not. */
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
  const dance = {
    figure,
    placement: place,
    fps: 30,
    frames,
    roots: new Float64Array(frames * 3),
    rotations: new Float64Array(frames * JOINT_COUNT * 4),
  };
  for (let frame = 0; frame < frames; frame++) {
    dance.roots.set([0.02 * frame, 0.9 + 0.1 * Math.sin(frame / 5), -0.01 * frame], frame * 3);
    for (let joint = 0; joint < JOINT_COUNT; joint++) {
      const size = straight && joint === 1 ? 0 : 1;
      const [x, y, z] = [0.3, 0.5, 0.7].map((speed, axis) => size * 1.1 * Math.sin(speed * (frame / 4) + joint + axis));
      fromRotationVector(dance.rotations, (frame * JOINT_COUNT + joint) * 4, x, joint === 0 ? frame / 6 : y, z);
    }
  }
  return dance;
}

/** The golden motion, or another of them, at the best rate there is of each block; standing at a place. */
export function goldenMotion(which = 0, { x, z, turn }: Placement = STAGE_CENTRE): SampledMotion {
  return runToCompletion(sampleMotion(goldenStore(which, { x, z, turn })));
}

/** Its blocks. */
export function goldenStore(which = 0, { x, z, turn }: Placement = STAGE_CENTRE): MotionBlockStore {
  const store = new MotionBlockStore(MotionTrack.fromDescription({ ...goldenDescription(which), place: [x, z, turn] }));
  const blocks = loadVectors<BlockVectors>("blocks").valid.filter(({ track }) => track === which);
  // the first is there at two rates of the first motion
  const indices = which === 0 ? [0, 0, 1, 2] : [0, 1, 2];
  indices.forEach((index, nth) => store.put(index, nth, decodeBase64(blocks[nth].block)));
  return store;
}

/** What a work makes, without a pause; it says rising shares on its way. */
export function runToCompletion<T>(work: IncrementalTask<T>): T {
  for (let before = 0; ; ) {
    const { done, value } = work.next();
    if (done) return value;
    expect(value).toBeGreaterThanOrEqual(before);
    expect(value).toBeLessThanOrEqual(1);
    before = value;
  }
}

/** The bytes of a file in parts. */
export async function joinParts(parts: Uint8Array<ArrayBuffer>[]): Promise<ArrayBuffer> {
  return new Blob(parts).arrayBuffer();
}

/** World places of the joints in a frame (54) on the stage that all dancers share, metres. */
export function jointPositions(dance: SampledMotion, frame: number): Float64Array {
  return worldTransforms(
    dance.figure,
    applyPlacement(poseAt(dance, frame, restPose()), dance.placement),
    createWorldTransforms(),
  ).positions.slice();
}

/** Plays `clip` on `root`, frame by frame, and says how far a joint that is found by its name is from the dance's at most, metres. */
export function maxJointError(
  dance: SampledMotion,
  root: Object3D,
  clip: AnimationClip,
  unit = 1,
  find = (name: string) => root.getObjectByName(name),
): number {
  const mixer = new AnimationMixer(root);
  mixer.clipAction(clip).play();
  const at = new Vector3();
  let most = 0;
  for (let frame = 0; frame < dance.frames; frame++) {
    // the last frame is the end of the loop, where it begins again
    mixer.setTime(Math.min(frame / dance.fps, clip.duration - 1e-6));
    root.updateMatrixWorld(true);
    const places = jointPositions(dance, frame);
    for (const name of JOINTS) {
      const joint = find(name);
      if (!joint) throw new Error(`no ${name} in what was read`);
      at.setFromMatrixPosition(joint.matrixWorld).multiplyScalar(unit);
      const k = JOINTS.indexOf(name) * 3;
      most = Math.max(most, Math.hypot(at.x - places[k], at.y - places[k + 1], at.z - places[k + 2]));
    }
  }
  return most;
}
