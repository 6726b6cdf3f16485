import { AnimationMixer, type Object3D, Quaternion, type SkinnedMesh, Vector3 } from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { describe, expect, test } from "vitest";
import { type PuppetModel, writeGlb } from "../../src/export/glb";
import type { SampledMotion } from "../../src/export/sampled-motion";
import { JOINTS } from "../../src/motion/skeleton";
import { createPuppetModel } from "../../src/stage/puppet/puppet-model";
import { createOtherFigure, createStandardFigure } from "../stage/puppet/figures";
import { goldenMotion, joinParts, jointPositions, maxJointError, runToCompletion, turningMotion } from "./motions";

/** What three.js reads of the file of these dances; those of one figure have one model. */
async function read(...dances: SampledMotion[]) {
  const models = new Map(dances.map(({ figure }) => [figure, createPuppetModel(figure)]));
  const danced = dances.map((dance) => ({ motion: dance, model: models.get(dance.figure) as PuppetModel }));
  const file = await joinParts(runToCompletion(writeGlb(danced, "a dance", null)));
  return { ...(await new GLTFLoader().parseAsync(file, "")), size: file.byteLength };
}

const ALONE: [string, SampledMotion][] = [
  ["turning", turningMotion()],
  ["of another build", turningMotion({ figure: createOtherFigure() })],
  ["golden", goldenMotion()],
  ["away from the middle", goldenMotion(1, { x: -2, z: 0.5, turn: 1 })],
];

test.each(ALONE)("three.js reads a dance %s as it is", async (_, dance) => {
  const { scene, animations } = await read(dance);
  expect(animations[0].name).toBe("a dance");
  expect(animations[0].duration).toBeCloseTo((dance.frames - 1) / dance.fps, 5);
  expect(maxJointError(dance, scene, animations[0])).toBeLessThan(1e-4);
});

test("the puppet hangs on its bones: each vertex where it is at rest, and in a dance with its bone", async () => {
  const dance = turningMotion();
  const { scene, animations, size } = await read(dance);
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
  maxJointError(dance, scene, animations[0]);
  expect(local.size).toBeGreaterThan(50);
  for (const [vertex, place] of local) {
    body.getVertexPosition(vertex, at);
    expect(at.distanceTo(body.skeleton.bones[skinIndex.getX(vertex)].localToWorld(place.clone()))).toBeLessThan(1e-5);
  }
});

test("sleeves hang: with the arms out to the sides their bags point down", async () => {
  const dance = turningMotion();
  dance.rotations.fill(0);
  for (let at = 0; at < dance.rotations.length; at += 4) dance.rotations[at] = 1;
  for (let frame = 0; frame < dance.frames; frame++) {
    dance.rotations.set([Math.SQRT1_2, 0, 0, Math.SQRT1_2], (frame * 18 + 12) * 4);
    dance.rotations.set([Math.SQRT1_2, 0, 0, -Math.SQRT1_2], (frame * 18 + 15) * 4);
  }
  const { scene, animations } = await read(dance);
  maxJointError(dance, scene, animations[0]);
  for (const name of ["l_sleeve", "r_sleeve"]) {
    const turn = (scene.getObjectByName(name) as Object3D).getWorldQuaternion(new Quaternion());
    // drawn hanging to the back of an arm that hangs down
    expect(new Vector3(0, 0, -1).applyQuaternion(turn).y).toBeLessThan(-0.9);
  }
});

describe("several dancers in one file", () => {
  const figure = createStandardFigure();
  const dances = [
    turningMotion({ figure, place: { x: -1, z: 0, turn: 0 } }),
    goldenMotion(1, { x: 1.3, z: -0.4, turn: 2.2 }),
    turningMotion({ figure, place: { x: 0, z: 1.5, turn: -0.7 } }),
  ];

  test("stand each in its place and dance its own dance, as three.js reads them", async () => {
    const { scene, animations } = await read(...dances);
    expect(animations.map(({ name }) => name)).toEqual(["a dance"]);
    dances.forEach((dance, nth) =>
      expect(maxJointError(dance, scene, animations[0], 1, (name) => jointOf(scene, nth, name))).toBeLessThan(1e-4),
    );
  });

  test("have a puppet each, which hangs on its own bones; those of equal lengths have one mesh", async () => {
    const { scene, animations, size } = await read(...dances);
    const alone = await Promise.all([read(dances[0]), read(dances[1])]);
    expect(size).toBeLessThan(alone[0].size + alone[1].size + 100_000);
    const mixer = new AnimationMixer(scene);
    mixer.clipAction(animations[0]).play();
    mixer.setTime(0.8);
    scene.updateMatrixWorld(true);
    const at = new Vector3();
    dances.forEach((_, nth) => {
      const head = jointOf(scene, nth, "skullbase") as Object3D;
      const meshes = scene.getObjectByName(`puppet_${nth + 1}`)?.children as SkinnedMesh[];
      expect(
        meshes.map(({ skeleton }) => skeleton.bones.includes(head as SkinnedMesh["skeleton"]["bones"][0])),
      ).toEqual([true, true]);
      // the second of the two is the face, all of it on the head
      const face = meshes[1];
      const { index } = face.geometry;
      for (let nth = 0; nth < (index?.count ?? 0); nth += 97) {
        face.getVertexPosition(index?.getX(nth) as number, at).applyMatrix4(face.matrixWorld);
        expect(at.distanceTo(new Vector3().setFromMatrixPosition(head.matrixWorld))).toBeLessThan(0.4);
      }
    });
  });

  test("have sleeves that swing by their own dance alone, though one model danced before", async () => {
    const { animations } = await read(...dances);
    const [first, third] = ["l_sleeve", "l_sleeve_2"].map(
      (name) => animations[0].tracks.find((track) => track.name === `${name}.quaternion`)?.values,
    );
    expect(first?.length).toBe(dances[0].frames * 4);
    expect(third).toEqual(first);
  });

  test("who is done dancing stands still while others dance", async () => {
    const { scene, animations } = await read(...dances);
    const [, short] = dances;
    const mixer = new AnimationMixer(scene);
    mixer.clipAction(animations[0]).play();
    mixer.setTime((short.frames - 1) / short.fps + 0.1);
    scene.updateMatrixWorld(true);
    const wrist = new Vector3().setFromMatrixPosition((jointOf(scene, 1, "l_wrist") as Object3D).matrixWorld);
    const at = JOINTS.indexOf("l_wrist") * 3;
    expect(wrist.distanceTo(new Vector3().fromArray(jointPositions(short, short.frames - 1), at))).toBeLessThan(1e-4);
  });
});

/** The joint of this name of a dancer, by number, of several: three.js numbers names that are there already. */
function jointOf(scene: Object3D, nth: number, name: string): Object3D | undefined {
  let found: Object3D | undefined;
  scene.getObjectByName(`dancer_${nth + 1}`)?.traverse((one) => {
    if (one.name.replace(/_\d+$/, "") === name) found = one;
  });
  return found;
}
