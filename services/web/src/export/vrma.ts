/**
 * VRM Animation export, which animates any VRM avatar (https://github.com/vrm-c/vrm-specification,
 * VRMC_vrm_animation-1.0).
 */

import { ExtendedHumanoid } from "../motion/extended-humanoid";
import { chainJoints, type Hands, VRM_NAMES, WRISTS } from "../motion/hands";
import { BONE_PARENTS, BONES, createHumanoidPose, T_POSE_TO_REST, toHumanoid, tPoseFigure } from "../motion/humanoid";
import { conjugate, fromRotationVector, rotate } from "../motion/rotation";
import { restPose } from "../motion/skeleton";
import { ExportSkeleton, handJoints } from "./export-skeleton";
import { frameTimes, GltfBuilder, writeRotation } from "./gltf";
import { FRAMES_PER_STEP, frameValuesAt, type IncrementalTask, poseAt, type SampledMotion } from "./sampled-motion";
import { addFace } from "./vrma-face";

const EXTENSION = "VRMC_vrm_animation";

/** A bone of the file in the T-pose. */
interface FileBone {
  readonly name: string;
  readonly parent: number;
  readonly offset: Iterable<number>;
}

/** A bone of a finger, the index of its joint, and the rotation from the wrist's frame at rest to the T-pose. */
interface FingerBone extends FileBone {
  readonly joint: number;
  readonly toTPose: Float64Array;
}

/**
 * Write a motion as rotations of humanoid bones from the T-pose and positions of the hips, in metres, with fingers and
 * face as far as it has them. The placement on the stage is left out: a file is for one avatar at its own position, and
 * players scale the hips' path by the avatar's height, which would move several performers closer together the smaller
 * their avatars are.
 */
export function* writeVrma(motion: SampledMotion, name: string): IncrementalTask<Uint8Array<ArrayBuffer>[]> {
  const { figure, fps, frames } = motion;
  const asset = new GltfBuilder();
  const extension = motion.extension?.extension;
  const skeleton = new ExportSkeleton(figure, extension);
  const extended = extension && new ExtendedHumanoid(figure, extension);
  const { offsets } = extended ?? tPoseFigure(figure);
  const body: FileBone[] = (extended?.bones ?? BONES.map((bone, at) => ({ name: bone, parent: BONE_PARENTS[at] }))).map(
    ({ name: bone, parent }, at) => ({ name: bone, parent, offset: offsets.subarray(at * 3, at * 3 + 3) }),
  );
  const fingers = motion.hands ? createFingerBones(motion.hands.hands, body) : [];
  const bones = [...body, ...fingers];
  bones.forEach(({ name: bone, offset }, at) => {
    const children = bones.flatMap(({ parent }, child) => (parent === at ? [child] : []));
    asset.nodes.push({ name: bone, translation: [...offset], ...(children.length > 0 ? { children } : {}) });
  });
  const hips = new Float32Array(frames * 3);
  const rotations = bones.map(() => new Float32Array(frames * 4));
  const pose = restPose(),
    humanoid = createHumanoidPose();
  const turns = new Float64Array(bones.length * 4);
  for (let frame = 0; frame < frames; frame++) {
    toHumanoid(figure, poseAt(motion, frame, pose), humanoid);
    hips.set(humanoid.hips, frame * 3);
    const values = frameValuesAt(motion, frame);
    const extendedPose = skeleton.extend(pose, values.extension);
    if (extended && extendedPose) extended.rotations(extendedPose, turns);
    else turns.set(humanoid.rotations);
    if (values.hands) writeFingerTurns(fingers, values.hands, turns, body.length);
    for (let bone = 0; bone < bones.length; bone++) writeRotation(rotations[bone], frame * 4, turns, bone * 4);
    if (frame % FRAMES_PER_STEP === 0) yield frame / frames;
  }
  const times = asset.addAccessor(frameTimes(frames, fps), "SCALAR", { bounded: true });
  asset.addChannel(0, "translation", times, hips);
  rotations.forEach((turn, bone) => asset.addChannel(bone, "rotation", times, turn));
  const { nodes: faceNodes, ...face } = addFace(asset, motion, times);
  asset.extraProperties.extensionsUsed = [EXTENSION];
  asset.extraProperties.extensions = {
    [EXTENSION]: {
      specVersion: "1.0",
      humanoid: { humanBones: Object.fromEntries(bones.map(({ name: bone }, node) => [bone, { node }])) },
      ...face,
    },
  };
  return asset.build([0, ...faceNodes], name);
}

/** Return the bones of the fingers, which follow those of the body. */
function createFingerBones(hands: Hands, body: readonly FileBone[]): FingerBone[] {
  const chains = chainJoints(hands);
  const bones: FingerBone[] = [];
  WRISTS.forEach((wrist, side) => {
    const toTPose = new Float64Array(4);
    conjugate(toTPose, 0, T_POSE_TO_REST, wrist * 4);
    const hand = body.findIndex(({ name }) => name === BONES[wrist - 1]);
    for (const { index, place, offset } of handJoints(hands, side)) {
      const [chain] = chains[index];
      const raisedOffset = new Float64Array(3);
      rotate(raisedOffset, 0, toTPose, 0, offset, 0);
      const parent = place === 0 ? hand : body.length + bones.length - 1;
      bones.push({ name: VRM_NAMES[chain][place], parent, offset: raisedOffset, joint: index, toTPose });
    }
  });
  return bones;
}

const raised = new Float64Array(3);

/** Write the rotations of the fingers, from bone `first` on. */
function writeFingerTurns(
  fingers: readonly FingerBone[],
  values: Float64Array,
  out: Float64Array,
  first: number,
): void {
  fingers.forEach(({ joint, toTPose }, at) => {
    rotate(raised, 0, toTPose, 0, values, joint * 3);
    fromRotationVector(out, (first + at) * 4, raised[0], raised[1], raised[2]);
  });
}
