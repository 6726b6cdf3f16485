import { Mesh, type Object3D, Quaternion, Vector3 } from "three";
import { expect, test } from "vitest";
import { Avatar } from "../../../src/avatar/avatar";
import { AvatarModel } from "../../../src/avatar/model";
import type { StagedPose } from "../../../src/motion/extension";
import { restPose } from "../../../src/motion/skeleton";
import { createStandardFigure } from "../../stage/puppet/figures";
import { createFaceFile, type FaceOptions } from "./face-files";
import { faceOf } from "./faces";

const EYE_MORPHS = ["eyeLookOutLeft", "eyeLookInLeft", "eyeLookInRight", "eyeLookOutRight", "eyeLookUpLeft"];

async function create(options: FaceOptions): Promise<{ avatar: Avatar; model: AvatarModel }> {
  const model = await AvatarModel.parse(createFaceFile(options).buffer, "boxes");
  return { avatar: new Avatar(model, createStandardFigure()), model };
}

/** Return the weights of the mesh's morph targets above 0, by name. */
function shown(model: AvatarModel): Record<string, number> {
  const found: Record<string, number> = {};
  model.root.traverse((mesh) => {
    if (!(mesh instanceof Mesh)) return;
    for (const [name, index] of Object.entries((mesh as Mesh).morphTargetDictionary ?? {})) {
      const weight = (mesh as Mesh).morphTargetInfluences?.[index] ?? 0;
      if (weight !== 0) found[name] = Math.round(weight * 1e6) / 1e6;
    }
  });
  return found;
}

const pose = (weights: Record<string, number> | null): StagedPose => ({
  ...restPose(),
  face: weights && faceOf(weights),
});

/** Return the direction of an eye from that at rest: to the left, and up, in radians. */
function gazeOf(node: Object3D, rest: Quaternion): { yaw: number; pitch: number } {
  const forward = new Vector3(0, 0, 1).applyQuaternion(
    node.getWorldQuaternion(new Quaternion()).multiply(rest.clone().invert()),
  );
  return { yaw: Math.atan2(forward.x, forward.z), pitch: Math.asin(forward.y) };
}

test("expressions of VRM 1 follow the face, and return to rest without one", async () => {
  const morphs = ["one", "two", "three", "four"];
  const { avatar, model } = await create({
    vrm: 1,
    morphs,
    presets: ["aa", "happy"],
    custom: ["EyeBlinkLeft", "BrowDownLeft"],
  });
  avatar.apply(pose({ jawOpen: 0.5, eyeBlinkLeft: 1, eyeBlinkRight: 0 }), 0);
  expect(shown(model)).toEqual({ one: 0.5, three: 1 });
  avatar.apply(pose({ jawOpen: 0.25 }), 0);
  expect(shown(model)).toEqual({ one: 0.25 });
  avatar.apply(pose(null), 0);
  expect(shown(model)).toEqual({});
});

test("presets of VRM 0 follow the face", async () => {
  const { avatar, model } = await create({ vrm: 0, morphs: ["one", "two", "three"], presets: ["a", "joy", "blink_l"] });
  avatar.apply(pose({ aa: 0.5, happy: 0.3, blinkLeft: 1, blinkRight: 0 }), 0);
  expect(shown(model)).toEqual({ one: 0.5, two: 0.3, three: 1 });
});

test("morph targets of a plain file follow the face by name", async () => {
  const { avatar, model } = await create({ morphs: ["Wolf3D.jawOpen", "mouthSmile_L", "mouthSmile_R", "belly"] });
  avatar.apply(pose({ jawOpen: 0.5, mouthSmileLeft: 0.25, mouthSmileRight: 1 }), 0);
  expect(shown(model)).toEqual({ "Wolf3D.jawOpen": 0.5, mouthSmile_L: 0.25, mouthSmile_R: 1 });
  avatar.apply(pose(null), 0);
  expect(shown(model)).toEqual({});
});

test("the gaze turns the eyes of a VRM file", async () => {
  const { avatar, model } = await create({ vrm: 1, morphs: [], lookAt: "bone", eyes: ["a", "b"] });
  const node = model.nodes.get("leftEye") as Object3D;
  avatar.apply(pose(null), 0);
  const rest = node.getWorldQuaternion(new Quaternion());
  avatar.apply(pose({ gazeYaw: 0.6, gazePitch: 0.3 }), 0);
  // The range of the file is a third of the angle.
  expect(gazeOf(node, rest).yaw).toBeCloseTo(0.2, 2);
  expect(gazeOf(node, rest).pitch).toBeCloseTo(0.1, 2);
  avatar.apply(pose(null), 0);
  expect(node.getWorldQuaternion(new Quaternion()).angleTo(rest)).toBeLessThan(1e-6);
});

test("the gaze sets the expressions of a VRM file", async () => {
  const presets = ["lookLeft", "lookRight", "lookUp", "lookDown"];
  const { avatar, model } = await create({ vrm: 1, morphs: presets, presets, lookAt: "expression" });
  avatar.apply(pose({ gazeYaw: 0.9, gazePitch: -0.45 }), 0);
  const { lookLeft, lookDown, ...others } = shown(model);
  expect(lookLeft).toBeCloseTo(0.9 / (Math.PI / 2), 5);
  expect(lookDown).toBeCloseTo(0.45 / (Math.PI / 2), 5);
  expect(others).toEqual({});
  avatar.apply(pose(null), 0);
  expect(shown(model)).toEqual({});
});

test.each([
  ["eye.L", "eye.R"],
  ["LeftEye", "RightEye"],
  ["CC_Base_L_Eye", "CC_Base_R_Eye"],
])("the gaze turns joints named %s", async (left, right) => {
  const { avatar, model } = await create({ morphs: [], eyes: ["LeftEyelid", left, right], facing: 90, askew: true });
  let node: Object3D | null = null;
  model.root.traverse((object) => {
    if (object.userData.name === left || object.name === left) node = object;
  });
  avatar.apply(pose(null), 0);
  const rest = (node as unknown as Object3D).getWorldQuaternion(new Quaternion());
  avatar.apply(pose({ gazeYaw: 0.4, gazePitch: -0.2 }), 0);
  const { yaw, pitch } = gazeOf(node as unknown as Object3D, rest);
  expect(yaw).toBeCloseTo(0.4, 4);
  expect(pitch).toBeCloseTo(-0.2, 4);
  avatar.apply(pose({ gazeYaw: 1.5 }), 0);
  expect(gazeOf(node as unknown as Object3D, rest).yaw).toBeLessThan(0.7);
});

test("the gaze sets the blend shapes of a plain file", async () => {
  const { avatar, model } = await create({ morphs: EYE_MORPHS });
  avatar.apply(pose({ gazeYaw: (35 * Math.PI) / 360, gazePitch: (25 * Math.PI) / 180 }), 0);
  expect(shown(model)).toEqual({ eyeLookOutLeft: 0.5, eyeLookInRight: 0.5, eyeLookUpLeft: 1 });
  avatar.apply(pose({ eyeLookInLeft: 0.25, eyeLookOutRight: 0.25 }), 0);
  expect(shown(model)).toEqual({ eyeLookInLeft: 0.25, eyeLookOutRight: 0.25 });
});

test("an avatar without a face blinks as the stage says", async () => {
  const { avatar, model } = await create({ morphs: ["eyeBlinkLeft", "eyeBlinkRight"] });
  for (const blink of [0.25, 1, 0.5]) {
    avatar.apply(pose(null), 1 / 60, blink);
    expect(shown(model)).toEqual({ eyeBlinkLeft: blink, eyeBlinkRight: blink });
  }
  avatar.apply(pose(null), 1 / 60, 0);
  expect(shown(model)).toEqual({});
});

test("an avatar does not blink where the face knows the eyelids", async () => {
  const { avatar, model } = await create({ vrm: 1, morphs: ["one", "two"], presets: ["blink", "aa"] });
  avatar.apply(pose({ aa: 0.5 }), 1 / 60, 0.75);
  expect(shown(model)).toEqual({ one: 0.75, two: 0.5 });
  avatar.apply(pose({ blink: 0.125 }), 1 / 60, 0.75);
  expect(shown(model)).toEqual({ one: 0.125 });
  avatar.apply(pose(null), 1 / 60, 0.25);
  expect(shown(model)).toEqual({ one: 0.25 });
});
