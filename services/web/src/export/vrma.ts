/** Motion as VRM Animation, which moves any VRM avatar (https://github.com/vrm-c/vrm-specification, VRMC_vrm_animation-1.0). */

import { BONE_COUNT, BONE_PARENTS, BONES, createHumanoidPose, toHumanoid, tPoseFigure } from "../motion/humanoid";
import { restPose } from "../motion/skeleton";
import { frameTimes, GltfBuilder, writeRotation } from "./gltf";
import { FRAMES_PER_STEP, type IncrementalTask, poseAt, type SampledMotion } from "./sampled-motion";

const EXTENSION = "VRMC_vrm_animation";

/**
 * `dance` of this `name` as the turns of a humanoid's bones from its T-pose, and where its hips are, metres. The place on the
 * stage is left out: a file is of one avatar about where that stands, and its player measures the hips' way by the avatar's
 * height, so that dancers would come nearer to each other as their avatars are smaller.
 */
export function* writeVrma(motion: SampledMotion, name: string): IncrementalTask<Uint8Array<ArrayBuffer>[]> {
  const { figure, fps, frames } = motion;
  const asset = new GltfBuilder();
  const { offsets } = tPoseFigure(figure);
  BONES.forEach((bone, at) => {
    const children = BONE_PARENTS.flatMap((parent, child) => (parent === at ? [child] : []));
    asset.nodes.push({
      name: bone,
      translation: [...offsets.subarray(at * 3, at * 3 + 3)],
      ...(children.length > 0 ? { children } : {}),
    });
  });
  const hips = new Float32Array(frames * 3);
  const turns = BONES.map(() => new Float32Array(frames * 4));
  const pose = restPose(),
    humanoid = createHumanoidPose();
  for (let frame = 0; frame < frames; frame++) {
    toHumanoid(figure, poseAt(motion, frame, pose), humanoid);
    hips.set(humanoid.hips, frame * 3);
    for (let bone = 0; bone < BONE_COUNT; bone++) writeRotation(turns[bone], frame * 4, humanoid.rotations, bone * 4);
    if (frame % FRAMES_PER_STEP === 0) yield frame / frames;
  }
  const times = asset.addAccessor(frameTimes(frames, fps), "SCALAR", { bounded: true });
  asset.addChannel(0, "translation", times, hips);
  turns.forEach((turn, bone) => asset.addChannel(bone, "rotation", times, turn));
  asset.extraProperties.extensionsUsed = [EXTENSION];
  asset.extraProperties.extensions = {
    [EXTENSION]: {
      specVersion: "1.0",
      humanoid: { humanBones: Object.fromEntries(BONES.map((bone, node) => [bone, { node }])) },
    },
  };
  return asset.build([0], name);
}
