/**
 * VRM Animation export, which animates any VRM avatar (https://github.com/vrm-c/vrm-specification,
 * VRMC_vrm_animation-1.0).
 */

import { ExtendedHumanoid } from "../motion/extended-humanoid";
import { BONE_PARENTS, BONES, createHumanoidPose, toHumanoid, tPoseFigure } from "../motion/humanoid";
import { restPose } from "../motion/skeleton";
import { ExportSkeleton } from "./export-skeleton";
import { frameTimes, GltfBuilder, writeRotation } from "./gltf";
import { extensionValuesAt, FRAMES_PER_STEP, type IncrementalTask, poseAt, type SampledMotion } from "./sampled-motion";

const EXTENSION = "VRMC_vrm_animation";

/**
 * Write a motion as rotations of humanoid bones from the T-pose and positions of the hips, in metres. The placement on
 * the stage is left out: a file is for one avatar at its own position, and players scale the hips' path by the avatar's
 * height, which would move several performers closer together the smaller their avatars are.
 */
export function* writeVrma(motion: SampledMotion, name: string): IncrementalTask<Uint8Array<ArrayBuffer>[]> {
  const { figure, fps, frames } = motion;
  const asset = new GltfBuilder();
  const extension = motion.extension?.extension;
  const skeleton = new ExportSkeleton(figure, extension);
  const extended = extension && new ExtendedHumanoid(figure, extension);
  const bones = extended ? extended.bones.map((bone) => bone.name) : BONES;
  const parents = extended ? extended.bones.map(({ parent }) => parent) : BONE_PARENTS;
  const { offsets } = extended ?? tPoseFigure(figure);
  bones.forEach((bone, at) => {
    const children = parents.flatMap((parent, child) => (parent === at ? [child] : []));
    asset.nodes.push({
      name: bone,
      translation: [...offsets.subarray(at * 3, at * 3 + 3)],
      ...(children.length > 0 ? { children } : {}),
    });
  });
  const hips = new Float32Array(frames * 3);
  const rotations = bones.map(() => new Float32Array(frames * 4));
  const pose = restPose(),
    humanoid = createHumanoidPose();
  const turns = new Float64Array(bones.length * 4);
  for (let frame = 0; frame < frames; frame++) {
    toHumanoid(figure, poseAt(motion, frame, pose), humanoid);
    hips.set(humanoid.hips, frame * 3);
    const extendedPose = skeleton.extend(pose, extensionValuesAt(motion, frame));
    if (extended && extendedPose) extended.rotations(extendedPose, turns);
    else turns.set(humanoid.rotations);
    for (let bone = 0; bone < bones.length; bone++) writeRotation(rotations[bone], frame * 4, turns, bone * 4);
    if (frame % FRAMES_PER_STEP === 0) yield frame / frames;
  }
  const times = asset.addAccessor(frameTimes(frames, fps), "SCALAR", { bounded: true });
  asset.addChannel(0, "translation", times, hips);
  rotations.forEach((turn, bone) => asset.addChannel(bone, "rotation", times, turn));
  asset.extraProperties.extensionsUsed = [EXTENSION];
  asset.extraProperties.extensions = {
    [EXTENSION]: {
      specVersion: "1.0",
      humanoid: { humanBones: Object.fromEntries(bones.map((bone, node) => [bone, { node }])) },
    },
  };
  return asset.build([0], name);
}
