import { type VRM1Meta, VRMCore, type VRMHumanBones, VRMHumanoid } from "@pixiv/three-vrm";
import { createVRMAnimationClip, type VRMAnimation, VRMAnimationLoaderPlugin } from "@pixiv/three-vrm-animation";
import { AnimationMixer, Group, Object3D, Quaternion, Vector3 } from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { describe, expect, test } from "vitest";
import { poseAt, type SampledMotion } from "../../src/export/sampled-motion";
import { writeVrma } from "../../src/export/vrma";
import { BONE_PARENTS, BONES, tPoseFigure } from "../../src/motion/humanoid";
import { createWorldTransforms, restPose, worldTransforms } from "../../src/motion/skeleton";
import { goldenMotion, joinParts, runToCompletion, turningMotion } from "./motions";

async function read(motion: SampledMotion): Promise<VRMAnimation> {
  const loader = new GLTFLoader();
  loader.register((parser) => new VRMAnimationLoaderPlugin(parser));
  const { userData } = await loader.parseAsync(await joinParts(runToCompletion(writeVrma(motion, "a dance"))), "");
  const [animation] = userData.vrmAnimations as VRMAnimation[];
  return animation;
}

/** Create an avatar with the figure's proportions in the T-pose, with its own bone names. */
function avatar({ figure }: SampledMotion): VRMCore {
  const { offsets } = tPoseFigure(figure);
  const scene = new Group();
  const nodes = BONES.map((name) => Object.assign(new Object3D(), { name: `my_${name}` }));
  nodes.forEach((node, bone) => {
    node.position.fromArray(offsets, bone * 3);
    (BONE_PARENTS[bone] < 0 ? scene : nodes[BONE_PARENTS[bone]]).add(node);
  });
  scene.updateMatrixWorld(true);
  const humanoid = new VRMHumanoid(
    Object.fromEntries(BONES.map((name, bone) => [name, { node: nodes[bone] }])) as unknown as VRMHumanBones,
  );
  scene.add(humanoid.normalizedHumanBonesRoot);
  return new VRMCore({ scene, humanoid, meta: { metaVersion: "1" } as VRM1Meta });
}

const FROM_SPINE = BONES.indexOf("spine");

describe.each([
  ["turning", turningMotion()],
  ["with a straight sacroiliac", turningMotion({ straight: true })],
  ["golden", goldenMotion()],
  ["placed", goldenMotion(1, { x: 1.3, z: -0.4, turn: 2.2 })],
])("a %s motion", (_, motion) => {
  test("moves an avatar of the same proportions like the figure", async () => {
    const animation = await read(motion);
    expect(animation.humanoidTracks.rotation.size).toBe(BONES.length);
    expect(animation.humanoidTracks.translation.has("hips")).toBe(true);
    const vrm = avatar(motion);
    const clip = createVRMAnimationClip(animation, vrm);
    const mixer = new AnimationMixer(vrm.scene);
    mixer.clipAction(clip).play();
    const figureWorld = createWorldTransforms(),
      pose = restPose();
    const at = new Vector3(),
      expected = new Vector3(),
      shift = new Vector3(),
      turn = new Quaternion();
    const restRotation = new Quaternion();
    for (let frame = 0; frame < motion.frames; frame++) {
      mixer.setTime(Math.min(frame / motion.fps, clip.duration - 1e-6));
      vrm.update(0);
      vrm.scene.updateMatrixWorld(true);
      worldTransforms(motion.figure, poseAt(motion, frame, pose), figureWorld);
      shift.set(0, 0, 0);
      BONES.forEach((name, bone) => {
        const node = vrm.humanoid.getRawBoneNode(name as "hips") as Object3D;
        at.setFromMatrixPosition(node.matrixWorld);
        expected.fromArray(figureWorld.positions, (bone + 1) * 3);
        // The avatar's spine hangs from the hips, the figure's from the root: everything above is shifted.
        if (bone === FROM_SPINE) shift.subVectors(at, expected);
        expect(at.distanceTo(expected.add(shift))).toBeLessThan(1e-4);
        const [w, x, y, z] = figureWorld.orientations.subarray((bone + 1) * 4);
        restRotation.identity();
        if (/Arm|Hand/.test(name))
          restRotation.setFromAxisAngle(new Vector3(0, 0, 1), (name.startsWith("left") ? -1 : 1) * (Math.PI / 2));
        expect(node.getWorldQuaternion(turn).angleTo(new Quaternion(x, y, z, w).multiply(restRotation))).toBeLessThan(
          1e-3,
        );
      });
    }
  });
});

test("the placement is left out", async () => {
  const bytes = async (motion: SampledMotion) =>
    new Uint8Array(await joinParts(runToCompletion(writeVrma(motion, "a dance"))));
  expect(await bytes(goldenMotion(1, { x: 1.3, z: -0.4, turn: 2.2 }))).toEqual(await bytes(goldenMotion(1)));
});

test("with a straight sacroiliac nothing is shifted", async () => {
  const motion = turningMotion({ straight: true });
  const vrm = avatar(motion);
  const clip = createVRMAnimationClip(await read(motion), vrm);
  const mixer = new AnimationMixer(vrm.scene);
  mixer.clipAction(clip).play();
  mixer.setTime(20 / motion.fps);
  vrm.update(0);
  vrm.scene.updateMatrixWorld(true);
  const figureWorld = worldTransforms(motion.figure, poseAt(motion, 20, restPose()), createWorldTransforms());
  const hand = new Vector3().setFromMatrixPosition((vrm.humanoid.getRawBoneNode("leftHand") as Object3D).matrixWorld);
  expect(hand.distanceTo(new Vector3().fromArray(figureWorld.positions, 14 * 3))).toBeLessThan(1e-4);
});
