import { Group, Matrix4, type Object3D, Quaternion, Vector3 } from "three";
import { beforeAll, describe, expect, test } from "vitest";
import { Avatar } from "../../src/avatar/avatar";
import { AvatarModel } from "../../src/avatar/model";
import type { StagedPose } from "../../src/motion/extension";
import { type Figure, JOINTS, type Pose, restPose } from "../../src/motion/skeleton";
import { handlePosition } from "../../src/stage/puppet/performer";
import { SOLE_HEIGHT_M, jointPosition as standing } from "../../src/stage/puppet/standard-figure";
import { createOtherFigure, createStandardFigure } from "../stage/puppet/figures";
import { mixamoName } from "./figure-bones";
import { createFigureFile, type FigureOptions } from "./figure-files";

/** Bones of the limbs, and the joints of the figure at both ends. */
const LIMBS: readonly (readonly [bone: string, next: string, joint: string, after: string])[] = [
  ["leftUpperArm", "leftLowerArm", "l_shoulder", "l_elbow"],
  ["leftLowerArm", "leftHand", "l_elbow", "l_wrist"],
  ["rightUpperArm", "rightLowerArm", "r_shoulder", "r_elbow"],
  ["rightLowerArm", "rightHand", "r_elbow", "r_wrist"],
  ["leftUpperLeg", "leftLowerLeg", "l_hip", "l_knee"],
  ["leftLowerLeg", "leftFoot", "l_knee", "l_ankle"],
  ["rightUpperLeg", "rightLowerLeg", "r_hip", "r_knee"],
  ["rightLowerLeg", "rightFoot", "r_knee", "r_ankle"],
];

const FILES: Readonly<Record<string, FigureOptions>> = {
  "VRM 1": { vrm: 1 },
  "VRM 0, facing away": { vrm: 0 },
  "VRM 1 in askew axes, with short legs": { vrm: 1, askew: true, legLength: 0.6 },
  "a GLB in the T-pose, named as Mixamo does, in centimetres": { name: mixamoName, unit: 0.01, askew: true },
  "a GLB in the A-pose, facing aside": { arms: 45, legs: 8, facing: 90, askew: true },
  "a GLB on its back": { lying: true, unit: 0.01 },
};

const at = (object: Object3D) => new Vector3().setFromMatrixPosition(object.matrixWorld);
const of = (avatar: Avatar, joint: string) => new Vector3().setFromMatrixPosition(avatar.joint(joint));
const degrees = (a: Vector3, b: Vector3) => (a.angleTo(b) * 180) / Math.PI;

async function read(options: FigureOptions): Promise<AvatarModel> {
  return AvatarModel.parse(createFigureFile(options).buffer, "boxes");
}

/** Return a pose with every joint moved; `time` in seconds. */
function poseAt(time: number): Pose {
  const pose = restPose();
  standing("humanoid_root")
    .add(new Vector3(0.8 * Math.sin(time), 0.03 * Math.sin(3 * time), 0.5 * Math.cos(time)))
    .toArray(pose.root);
  JOINTS.forEach((name, k) => {
    const reach = /shoulder|elbow/.test(name) ? 1.2 : /hip|knee|wrist/.test(name) ? 0.5 : 0.2;
    const axis = new Vector3(Math.sin(k), Math.cos(2 * k), Math.sin(3 * k + 1)).normalize();
    const turn = new Quaternion().setFromAxisAngle(axis, reach * Math.sin(2 * time + k));
    pose.rotations.set([turn.w, turn.x, turn.y, turn.z], k * 4);
  });
  return pose;
}

function standingPose(): Pose {
  const pose = restPose();
  standing("humanoid_root").toArray(pose.root);
  return pose;
}

/** Return the height of the lowest vertex of an avatar's mesh. */
function lowest(avatar: Avatar): number {
  let least = Infinity;
  avatar.group.updateMatrixWorld(true);
  avatar.group.traverse((mesh) => {
    const skinned = mesh as Object3D & {
      isSkinnedMesh?: boolean;
      geometry: { attributes: { position: { count: number } } };
      getVertexPosition(i: number, out: Vector3): Vector3;
    };
    if (!skinned.isSkinnedMesh) return;
    for (let i = 0; i < skinned.geometry.attributes.position.count; i++)
      least = Math.min(least, skinned.getVertexPosition(i, new Vector3()).applyMatrix4(mesh.matrixWorld).y);
  });
  return least;
}

test("is as high as its head reaches, but not as an antenna", async () => {
  const figure = createStandardFigure();
  const [plain, large, antenna] = await Promise.all(
    [0.2, 0.8, 5].map(async (headHeight) => new Avatar(await read({ headHeight, unit: 0.01 }), figure)),
  );
  expect(plain.height).toBeGreaterThan(1.5);
  expect(plain.height).toBeLessThan(1.9);
  expect(large.height - plain.height).toBeGreaterThan(0.5);
  expect(antenna.height).toBeCloseTo(3 * antenna.scale, 6);
});

describe.each(Object.entries(FILES))("%s", (_, options) => {
  test("keeps a planted foot in place, whose direction stays, while the body moves", async () => {
    const model = await read(options);
    const avatar = new Avatar(model, createOtherFigure());
    const [, point] = model.rest.solePoints.get("leftFoot") as readonly Vector3[];
    const foot = model.nodes.get("leftFoot") as Object3D;
    const show = (frame: number, planted: number) => {
      const pose: StagedPose = poseAt(0.004 * frame);
      pose.contacts = { planted, controlled: 0, clock: 1e15 + 16_667 * frame };
      avatar.apply(pose, 1 / 60);
      return point.clone().applyMatrix4(foot.matrixWorld);
    };
    const place = show(0, 1);
    const direction = foot.getWorldQuaternion(new Quaternion());
    for (let frame = 1; frame < 25; frame++) {
      const held = show(frame, 1);
      expect(Math.hypot(held.x - place.x, held.z - place.z)).toBeLessThan(1e-6);
    }
    const plain = new Avatar(await read(options), createOtherFigure());
    plain.apply(poseAt(0.004 * 24), 1 / 60);
    const turned = foot.getWorldQuaternion(new Quaternion());
    show(39, 0);
    avatar.apply(poseAt(0.004 * 24), 1 / 60);
    expect(turned.angleTo(foot.getWorldQuaternion(new Quaternion()))).toBeLessThan(1e-6);
    expect(turned.angleTo(direction)).toBeGreaterThan(1e-4);
    expect(avatar.group.position.distanceTo(plain.group.position)).toBeLessThan(1e-9);
  });

  let model: AvatarModel;
  const figure = createOtherFigure();
  beforeAll(async () => {
    model = await read(options);
  });

  test("points its limbs as the figure does, within a degree", () => {
    const avatar = new Avatar(model, figure);
    for (let time = 0; time < 6; time += 0.37) {
      avatar.apply(poseAt(time), 0);
      for (const [bone, next, joint, after] of LIMBS) {
        const direction = at(model.nodes.get(next) as Object3D).sub(at(model.nodes.get(bone) as Object3D));
        expect(degrees(direction, of(avatar, after).sub(of(avatar, joint)))).toBeLessThan(1);
      }
    }
  });

  test("faces as the figure does, head up, with the figure's palms", () => {
    const avatar = new Avatar(model, figure);
    const pose = standingPose();
    const yaw = new Quaternion().setFromAxisAngle(new Vector3(0, 1, 0), 1);
    pose.rotations.set([yaw.w, yaw.x, yaw.y, yaw.z]);
    avatar.apply(pose, 0);
    const place = (bone: string) => at(model.nodes.get(bone) as Object3D);
    expect(
      degrees(place("leftUpperLeg").sub(place("rightUpperLeg")), new Vector3(1, 0, 0).applyQuaternion(yaw)),
    ).toBeLessThan(0.5);
    expect(
      degrees(place("leftToes").sub(place("leftFoot")).setY(0), new Vector3(0, 0, 1).applyQuaternion(yaw)),
    ).toBeLessThan(0.5);
    expect(place("head").y).toBeGreaterThan(place("hips").y + 0.3);
  });

  test("has the figure's size and stands on its floor", () => {
    const avatar = new Avatar(model, figure);
    avatar.apply(standingPose(), 0);
    expect(Math.abs(lowest(avatar) - avatar.ground)).toBeLessThan(0.01);
    const height = at(model.nodes.get("head") as Object3D).y - avatar.ground;
    expect(height).toBeGreaterThan(0.75 * of(avatar, "skullbase").y);
    expect(height).toBeLessThan(1.25 * of(avatar, "skullbase").y);
  });

  test("keeps a foot on the floor throughout a motion, without jumps", () => {
    const avatar = new Avatar(model, figure);
    let before: number | null = null;
    for (let time = 0; time < 4; time += 1 / 60) {
      avatar.apply(poseAt(time), 0);
      const sole = Math.min(
        ...[...model.rest.solePoints].flatMap(([foot, soles]) =>
          soles.map((place) => place.clone().applyMatrix4((model.nodes.get(foot) as Object3D).matrixWorld).y),
        ),
      );
      expect(Math.abs(sole - avatar.ground)).toBeLessThan(0.015);
      const height = avatar.root.elements[13];
      if (before !== null) expect(Math.abs(height - before)).toBeLessThan(0.03);
      before = height;
    }
  });

  test("has hands with the axes of the figure's", () => {
    const avatar = new Avatar(model, figure);
    for (const time of [0, 0.4, 1.3]) {
      avatar.apply(poseAt(time), 0);
      for (const [limb, name] of ["l_wrist", "r_wrist"].entries()) {
        const hand = avatar.hand(limb, 0.5, new Matrix4());
        const wanted = new Matrix4().extractRotation(avatar.joint(name)).elements;
        new Matrix4().extractRotation(hand).elements.forEach((value, k) => expect(value).toBeCloseTo(wanted[k], 5));
        // In the palm, beyond the handle.
        const [place, handle] = [new Vector3().setFromMatrixPosition(hand), avatar.handle(limb, new Vector3())];
        expect(place.distanceTo(handle)).toBeLessThan(0.05);
      }
    }
  });

  test("reaches a pull target when the figure's hand reaches its own", () => {
    const avatar = new Avatar(model, figure);
    const [pose, limb] = [poseAt(0.4), 0];
    avatar.apply(pose, 0);
    // Pull to where the hand is when the figure's arm is raised.
    const raised = poseAt(0.4);
    const turn = new Quaternion(
      ...(([1, 2, 3, 0] as const).map((k) => raised.rotations[JOINTS.indexOf("l_shoulder") * 4 + k]) as [
        number,
        number,
        number,
        number,
      ]),
    );
    turn.premultiply(new Quaternion().setFromAxisAngle(new Vector3(0, 0, 1), 0.5));
    raised.rotations.set([turn.w, turn.x, turn.y, turn.z], JOINTS.indexOf("l_shoulder") * 4);
    avatar.apply(raised, 0);
    const to = avatar.handle(limb, new Vector3());
    const expected = handlePosition(avatar, limb, new Vector3());
    expect(avatar.toStreamedHandle(limb, to, new Vector3()).distanceTo(expected)).toBeLessThan(1e-9);
    avatar.apply(pose, 0);
    // Nearly exact from a distance: the rest is corrected as the hand approaches.
    expect(avatar.toStreamedHandle(limb, to, new Vector3()).distanceTo(expected)).toBeLessThan(0.12);
  });
});

describe("an avatar", () => {
  test("travels in proportion to its legs", async () => {
    const model = await read({ vrm: 1, legLength: 0.6 });
    const avatar = new Avatar(model, createStandardFigure());
    const toesAfter = (pose: Pose) => {
      avatar.apply(pose, 0);
      return at(model.nodes.get("leftToes") as Object3D);
    };
    const from = toesAfter(standingPose());
    const moved = standingPose();
    moved.root[2] += 1;
    const hips = standing("l_hip").y - standing("l_midtarsal").y + SOLE_HEIGHT_M;
    const direction = at(model.nodes.get("leftUpperLeg") as Object3D).y - avatar.ground;
    expect(toesAfter(moved).z - from.z).toBeCloseTo(direction / hips, 1);
    expect(direction / hips).toBeLessThan(0.85);
  });

  test("has handles in the palms and on the knees", async () => {
    const model = await read({ name: mixamoName, unit: 0.01, askew: true });
    const avatar = new Avatar(model, createStandardFigure());
    avatar.apply(poseAt(1), 0);
    for (const [limb, bone, next] of [
      [0, "leftHand", "leftMiddleProximal"],
      [1, "rightHand", "rightMiddleProximal"],
    ] as const) {
      const [hand, fingers] = [at(model.nodes.get(bone) as Object3D), at(model.nodes.get(next) as Object3D)];
      expect(avatar.handle(limb, new Vector3()).distanceTo(hand.lerp(fingers, 0.85))).toBeLessThan(0.02);
    }
    expect(avatar.handle(2, new Vector3()).distanceTo(at(model.nodes.get("leftLowerLeg") as Object3D))).toBeLessThan(
      0.02,
    );
  });

  test("has a tail that swings, and stops with reduced motion", async () => {
    const model = await read({ vrm: 1, tail: true });
    const avatar = new Avatar(model, createStandardFigure());
    const tail = model.root.getObjectByName("tail") as Object3D;
    avatar.apply(standingPose(), 0);
    const still = tail.quaternion.clone();
    for (let time = 0; time < 1; time += 1 / 60) avatar.apply(poseAt(3 * time), 1 / 60);
    expect(tail.quaternion.angleTo(still)).toBeGreaterThan(0.05);
    avatar.apply(poseAt(3), 0);
    expect(tail.quaternion.angleTo(still)).toBeLessThan(1e-6);
  });

  test("can perform with other limb lengths afterwards", async () => {
    const model = await read({ vrm: 1 });
    const heights = [1, 0.5].map((size) => {
      const figure: Figure = createStandardFigure(size);
      const avatar = new Avatar(model, figure);
      new Group().add(avatar.group);
      const pose = standingPose();
      for (let axis = 0; axis < 3; axis++) pose.root[axis] *= size;
      avatar.apply(pose, 0);
      const height = at(model.nodes.get("head") as Object3D).y;
      avatar.dispose();
      expect(avatar.group.parent).toBe(null);
      return height;
    });
    expect(heights[1] / heights[0]).toBeCloseTo(0.5, 2);
  });
});
