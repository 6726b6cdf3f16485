import { AnimationMixer, type Object3D, Quaternion, type SkinnedMesh, Vector3 } from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { describe, expect, test } from "vitest";
import { type PuppetModel, writeGlb } from "../../src/export/glb";
import type { SampledMotion } from "../../src/export/sampled-motion";
import { JOINTS } from "../../src/motion/skeleton";
import { createPuppetModel } from "../../src/stage/puppet/puppet-model";
import { createOtherFigure, createStandardFigure } from "../stage/puppet/figures";
import {
  extendedMotion,
  goldenMotion,
  joinParts,
  jointPositions,
  maxJointError,
  runToCompletion,
  turningMotion,
  withHands,
} from "./motions";

/** Write these motions as GLB and read them with three.js; motions of one figure share a model. */
async function read(...motions: SampledMotion[]) {
  const models = new Map(motions.map(({ figure }) => [figure, createPuppetModel(figure)]));
  const puppets = motions.map((motion) => ({ motion, model: models.get(motion.figure) as PuppetModel }));
  const file = await joinParts(runToCompletion(writeGlb(puppets, "a dance", null)));
  return { ...(await new GLTFLoader().parseAsync(file, "")), size: file.byteLength };
}

const ALONE: [string, SampledMotion][] = [
  ["turning", turningMotion()],
  ["differently proportioned", turningMotion({ figure: createOtherFigure() })],
  ["golden", goldenMotion()],
  ["placed", goldenMotion(1, { x: -2, z: 0.5, turn: 1 })],
  ["handed", withHands(goldenMotion(1, { x: -2, z: 0.5, turn: 1 }))],
  ["partly handed", withHands(turningMotion(), [2, 1, 0, 3, 0, 0, 0, 0, 0, 0])],
  ["handed, extended", withHands(extendedMotion(0))],
];

test.each(ALONE)("three.js reads a %s motion unchanged", async (_, motion) => {
  const { scene, animations } = await read(motion);
  expect(animations[0].name).toBe("a dance");
  expect(animations[0].duration).toBeCloseTo((motion.frames - 1) / motion.fps, 5);
  expect(maxJointError(motion, scene, animations[0])).toBeLessThan(1e-4);
});

test("the puppet's vertices move with their bones", async () => {
  const motion = turningMotion();
  const { scene, animations, size } = await read(motion);
  expect(size).toBeLessThan(2_500_000);
  const meshes: SkinnedMesh[] = [];
  scene.traverse((one) => "isSkinnedMesh" in one && meshes.push(one as SkinnedMesh));
  expect(meshes.map(({ skeleton }) => skeleton.bones.length)).toEqual([20, 20]);
  scene.updateMatrixWorld(true);
  const at = new Vector3();
  const local = new Map<number, Vector3>();
  const [body] = meshes;
  const { position, skinIndex, skinWeight, color } = body.geometry.attributes;
  expect(color.count).toBe(position.count);
  const rigid = (vertex: number) => skinWeight.getX(vertex) > 0.999;
  for (let vertex = 0; vertex < position.count; vertex += 97) {
    body.getVertexPosition(vertex, at);
    expect(at.distanceTo(new Vector3().fromBufferAttribute(position, vertex))).toBeLessThan(1e-5);
    if (rigid(vertex)) local.set(vertex, body.skeleton.bones[skinIndex.getX(vertex)].worldToLocal(at.clone()));
  }
  maxJointError(motion, scene, animations[0]);
  expect(local.size).toBeGreaterThan(50);
  for (const [vertex, place] of local) {
    body.getVertexPosition(vertex, at);
    expect(at.distanceTo(body.skeleton.bones[skinIndex.getX(vertex)].localToWorld(place.clone()))).toBeLessThan(1e-5);
  }
});

test.each([
  ["", turningMotion()],
  [" with an extension", extendedMotion(0)],
])("fingers are bones of the skin and move no vertex%s", async (_, motion) => {
  const [bare, handed] = await Promise.all([read(motion), read(withHands(motion))]);
  const meshOf = ({ scene }: typeof bare) => {
    let found: SkinnedMesh | null = null;
    scene.traverse((one) => {
      if (!found && "isSkinnedMesh" in one) found = one as SkinnedMesh;
    });
    return found as unknown as SkinnedMesh;
  };
  const meshes = [meshOf(bare), meshOf(handed)];
  expect(meshes[1].skeleton.bones.length - meshes[0].skeleton.bones.length).toBe(30);
  const places = meshes.map((mesh, at) => {
    const { scene, animations } = [bare, handed][at];
    maxJointError(at === 0 ? motion : withHands(motion), scene, animations[0]);
    return Array.from({ length: 40 }, (_, vertex) => mesh.getVertexPosition(vertex * 53, new Vector3()));
  });
  for (const [vertex, place] of places[0].entries()) expect(place.distanceTo(places[1][vertex])).toBeLessThan(1e-5);
});

test.each([
  ["", turningMotion()],
  [" with an extension", extendedMotion(0)],
])("a vertex has each joint once, and weights of sum 1%s", async (_, motion) => {
  const { scene } = await read(motion);
  scene.traverse((one) => {
    if (!("isSkinnedMesh" in one)) return;
    const { skinIndex, skinWeight } = (one as SkinnedMesh).geometry.attributes;
    for (let vertex = 0; vertex < skinIndex.count; vertex++) {
      const slots = [0, 1, 2, 3].map((slot) => [
        skinIndex.getComponent(vertex, slot),
        skinWeight.getComponent(vertex, slot),
      ]);
      const used = slots.filter(([, weight]) => weight > 0).map(([joint]) => joint);
      expect(new Set(used).size).toBe(used.length);
      expect(slots.reduce((sum, [, weight]) => sum + weight, 0)).toBeCloseTo(1, 5);
      expect(slots.every(([joint, weight]) => weight > 0 || joint === 0)).toBe(true);
    }
  });
});

test("sleeves hang down when the arms point sideways", async () => {
  const motion = turningMotion();
  motion.rotations.fill(0);
  for (let at = 0; at < motion.rotations.length; at += 4) motion.rotations[at] = 1;
  for (let frame = 0; frame < motion.frames; frame++) {
    motion.rotations.set([Math.SQRT1_2, 0, 0, Math.SQRT1_2], (frame * 18 + 12) * 4);
    motion.rotations.set([Math.SQRT1_2, 0, 0, -Math.SQRT1_2], (frame * 18 + 15) * 4);
  }
  const { scene, animations } = await read(motion);
  maxJointError(motion, scene, animations[0]);
  for (const name of ["l_sleeve", "r_sleeve"]) {
    const turn = (scene.getObjectByName(name) as Object3D).getWorldQuaternion(new Quaternion());
    // Modelled hanging to the back of a lowered arm.
    expect(new Vector3(0, 0, -1).applyQuaternion(turn).y).toBeLessThan(-0.9);
  }
});

describe("several performers in one file", () => {
  const figure = createStandardFigure();
  const motions = [
    turningMotion({ figure, place: { x: -1, z: 0, turn: 0 } }),
    goldenMotion(1, { x: 1.3, z: -0.4, turn: 2.2 }),
    turningMotion({ figure, place: { x: 0, z: 1.5, turn: -0.7 } }),
  ];

  test("keep their placement and motion, as three.js reads them", async () => {
    const { scene, animations } = await read(...motions);
    expect(animations.map(({ name }) => name)).toEqual(["a dance"]);
    motions.forEach((motion, index) =>
      expect(maxJointError(motion, scene, animations[0], 1, (name) => jointOf(scene, index, name))).toBeLessThan(1e-4),
    );
  });

  test("have a puppet each on its own bones, with a mesh per figure", async () => {
    const { scene, animations, size } = await read(...motions);
    const alone = await Promise.all([read(motions[0]), read(motions[1])]);
    expect(size).toBeLessThan(alone[0].size + alone[1].size + 100_000);
    const mixer = new AnimationMixer(scene);
    mixer.clipAction(animations[0]).play();
    mixer.setTime(0.8);
    scene.updateMatrixWorld(true);
    const at = new Vector3();
    motions.forEach((_, index) => {
      const head = jointOf(scene, index, "skullbase") as Object3D;
      const meshes = scene.getObjectByName(`puppet_${index + 1}`)?.children as SkinnedMesh[];
      expect(
        meshes.map(({ skeleton }) => skeleton.bones.includes(head as SkinnedMesh["skeleton"]["bones"][0])),
      ).toEqual([true, true]);
      // The second of the two is the face, which is on the head.
      const face = meshes[1];
      const { index: triangles } = face.geometry;
      for (let k = 0; k < (triangles?.count ?? 0); k += 97) {
        face.getVertexPosition(triangles?.getX(k) as number, at).applyMatrix4(face.matrixWorld);
        expect(at.distanceTo(new Vector3().setFromMatrixPosition(head.matrixWorld))).toBeLessThan(0.4);
      }
    });
  });

  test("have sleeves that swing independently although they share a model", async () => {
    const { animations } = await read(...motions);
    const [first, third] = ["l_sleeve", "l_sleeve_2"].map(
      (name) => animations[0].tracks.find((track) => track.name === `${name}.quaternion`)?.values,
    );
    expect(first?.length).toBe(motions[0].frames * 4);
    expect(third).toEqual(first);
  });

  test("who end earlier stand still while others continue", async () => {
    const { scene, animations } = await read(...motions);
    const [, short] = motions;
    const mixer = new AnimationMixer(scene);
    mixer.clipAction(animations[0]).play();
    mixer.setTime((short.frames - 1) / short.fps + 0.1);
    scene.updateMatrixWorld(true);
    const wrist = new Vector3().setFromMatrixPosition((jointOf(scene, 1, "l_wrist") as Object3D).matrixWorld);
    const at = JOINTS.indexOf("l_wrist") * 3;
    expect(wrist.distanceTo(new Vector3().fromArray(jointPositions(short, short.frames - 1), at))).toBeLessThan(1e-4);
  });
});

/** Return a joint of a performer by number: three.js adds numbers to repeated names. */
function jointOf(scene: Object3D, index: number, name: string): Object3D | undefined {
  let joint: Object3D | undefined;
  scene.getObjectByName(`dancer_${index + 1}`)?.traverse((one) => {
    if (one.name.replace(/_\d+$/, "") === name) joint = one;
  });
  return joint;
}
