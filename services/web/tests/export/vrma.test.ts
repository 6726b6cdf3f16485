import { type VRM1Meta, VRMCore, type VRMHumanBones, VRMHumanoid } from "@pixiv/three-vrm";
import { createVRMAnimationClip, type VRMAnimation, VRMAnimationLoaderPlugin } from "@pixiv/three-vrm-animation";
import { AnimationMixer, Euler, Group, Object3D, Quaternion, Vector3 } from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { describe, expect, test } from "vitest";
import { faceWeightsAt, frameValuesAt, poseAt, type SampledMotion } from "../../src/export/sampled-motion";
import { writeVrma } from "../../src/export/vrma";
import { expressionIndex } from "../../src/motion/face";
import { chainJoints, VRM_NAMES } from "../../src/motion/hands";
import { BONE_PARENTS, BONES, tPoseFigure } from "../../src/motion/humanoid";
import { createWorldTransforms, restPose, worldTransforms } from "../../src/motion/skeleton";
import {
  extendedMotion,
  goldenMotion,
  joinParts,
  runToCompletion,
  turningMotion,
  withFace,
  withHands,
} from "./motions";

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

test.each([
  ["", withHands(turningMotion())],
  [" of an extended figure", withHands(extendedMotion(0), [3, 3, 0, 2, 0, 1, 3, 3, 3, 3])],
])("fingers%s turn from the T-pose in the frames of the bones before them", async (_, motion) => {
  const { humanoidTracks } = await read(motion);
  const { hands } = motion.hands as NonNullable<SampledMotion["hands"]>;
  const expected = new Quaternion();
  const read20 = new Quaternion();
  chainJoints(hands).forEach(([chain, place], joint) => {
    const track = humanoidTracks.rotation.get(VRM_NAMES[chain][place] as "leftThumbProximal");
    const [x, y, z] = (frameValuesAt(motion, 20).hands as Float64Array).subarray(joint * 3);
    // The T-pose raises the arm sideways: down becomes outwards.
    const raised = new Vector3(x, y, z).applyAxisAngle(new Vector3(0, 0, 1), (chain < 5 ? 1 : -1) * (Math.PI / 2));
    expected.setFromAxisAngle(raised.clone().normalize(), raised.length());
    expect(read20.fromArray(track?.values ?? [], 20 * 4).angleTo(expected)).toBeLessThan(1e-3);
  });
});

test("a face is written as presets and custom expressions", async () => {
  const motion = withFace(turningMotion(), "jawOpen", "mouthSmileLeft", "mouthSmileRight", "happy", "aa");
  const { expressionTracks, lookAtTrack } = await read(motion);
  expect([...expressionTracks.preset.keys()].sort()).toEqual(["aa", "happy"]);
  expect([...expressionTracks.custom.keys()].sort()).toEqual(["jawOpen", "mouthSmileLeft", "mouthSmileRight"]);
  expect(lookAtTrack).toBe(null);
  for (const [name, { values }] of [...expressionTracks.preset, ...expressionTracks.custom])
    for (let frame = 0; frame < motion.frames; frame++)
      expect(values[frame]).toBeCloseTo((faceWeightsAt(motion, frame) as Float64Array)[expressionIndex(name)], 6);
});

test("the gaze is written as a rotation, not as expressions", async () => {
  const { expressionTracks, lookAtTrack } = await read(withFace(turningMotion(), "gazeYaw", "gazePitch", "lookLeft"));
  expect([...expressionTracks.preset.keys(), ...expressionTracks.custom.keys()]).toEqual([]);
  const euler = new Euler().setFromQuaternion(new Quaternion().fromArray(lookAtTrack?.values ?? []), "YXZ");
  expect(euler.y).toBeCloseTo(0.5, 5);
  // Positive about x is down.
  expect(euler.x).toBeCloseTo(-0.5 - 0.5 * Math.sin(1), 5);
});

test("blend shapes of the eyes are written as such", async () => {
  const { expressionTracks, lookAtTrack } = await read(withFace(turningMotion(), "eyeLookUpLeft", "eyeLookUpRight"));
  expect([...expressionTracks.custom.keys()]).toContain("eyeLookUpLeft");
  expect(lookAtTrack).toBe(null);
});
