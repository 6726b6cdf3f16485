/** Motion as VRM Animation, which moves any VRM avatar (https://github.com/vrm-c/vrm-specification, VRMC_vrm_animation-1.0). */

import { BONE_COUNT, BONE_PARENTS, BONES, emptyHumanoidPose, toHumanoid, tPose } from "../motion/humanoid";
import { restPose } from "../motion/skeleton";
import { type Dance, poseOf, STRIDE, type Work } from "./dance";
import { frameTimes, Gltf, putRotation } from "./gltf";

const EXTENSION = "VRMC_vrm_animation";

/**
 * `dance` of this `name` as the turns of a humanoid's bones from its T-pose, and where its hips are, metres. The place on the
 * stage is left out: a file is of one avatar about where that stands, and its player measures the hips' way by the avatar's
 * height, so that dancers would come nearer to each other as their avatars are smaller.
 */
export function* writeVrma(dance: Dance, name: string): Work<Uint8Array<ArrayBuffer>[]> {
  const { figure, fps, frames } = dance;
  const asset = new Gltf();
  const { offsets } = tPose(figure);
  BONES.forEach((bone, at) => {
    const children = BONE_PARENTS.flatMap((parent, child) => (parent === at ? [child] : []));
    asset.nodes.push({ name: bone, translation: [...offsets.subarray(at * 3, at * 3 + 3)], ...(children.length > 0 ? { children } : {}) });
  });
  const hips = new Float32Array(frames * 3);
  const turns = BONES.map(() => new Float32Array(frames * 4));
  const pose = restPose(), humanoid = emptyHumanoidPose();
  for (let frame = 0; frame < frames; frame++) {
    toHumanoid(figure, poseOf(dance, frame, pose), humanoid);
    hips.set(humanoid.hips, frame * 3);
    for (let bone = 0; bone < BONE_COUNT; bone++) putRotation(turns[bone], frame * 4, humanoid.rotations, bone * 4);
    if (frame % STRIDE === 0) yield frame / frames;
  }
  const times = asset.accessor(frameTimes(frames, fps), "SCALAR", { bounded: true });
  asset.animate(0, "translation", times, hips);
  turns.forEach((turn, bone) => asset.animate(bone, "rotation", times, turn));
  asset.more.extensionsUsed = [EXTENSION];
  asset.more.extensions = {
    [EXTENSION]: { specVersion: "1.0", humanoid: { humanBones: Object.fromEntries(BONES.map((bone, node) => [bone, { node }])) } },
  };
  return asset.file([0], name);
}
