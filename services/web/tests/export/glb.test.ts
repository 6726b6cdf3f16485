import { type Object3D, Quaternion, type SkinnedMesh, Vector3 } from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { expect, test } from "vitest";
import type { Dance } from "../../src/export/dance";
import { writeGlb } from "../../src/export/glb";
import { puppetModel } from "../../src/stage/model";
import { otherFigure } from "../stage/standard-figure";
import { farthest, finished, goldenDance, turning, whole } from "./dances";

async function read(dance: Dance) {
  const file = await whole(finished(writeGlb(dance, "a dance", puppetModel(dance.figure), null)));
  return { ...(await new GLTFLoader().parseAsync(file, "")), size: file.byteLength };
}

test.each([["turning", turning()], ["of another build", turning({ figure: otherFigure() })], ["golden", goldenDance()]])("three.js reads a dance %s as it is", async (_, dance) => {
  const { scene, animations } = await read(dance);
  expect(animations[0].name).toBe("a dance");
  expect(animations[0].duration).toBeCloseTo((dance.frames - 1) / dance.fps, 5);
  expect(farthest(dance, scene, animations[0])).toBeLessThan(1e-4);
});

test("the puppet hangs on its bones: each vertex where it is at rest, and in a dance with its bone", async () => {
  const dance = turning();
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
  farthest(dance, scene, animations[0]);
  expect(local.size).toBeGreaterThan(50);
  for (const [vertex, place] of local) {
    body.getVertexPosition(vertex, at);
    expect(at.distanceTo(body.skeleton.bones[skinIndex.getX(vertex)].localToWorld(place.clone()))).toBeLessThan(1e-5);
  }
});

test("sleeves hang: with the arms out to the sides their bags point down", async () => {
  const dance = turning();
  dance.rotations.fill(0);
  for (let at = 0; at < dance.rotations.length; at += 4) dance.rotations[at] = 1;
  for (let frame = 0; frame < dance.frames; frame++) {
    dance.rotations.set([Math.SQRT1_2, 0, 0, Math.SQRT1_2], (frame * 18 + 12) * 4);
    dance.rotations.set([Math.SQRT1_2, 0, 0, -Math.SQRT1_2], (frame * 18 + 15) * 4);
  }
  const { scene, animations } = await read(dance);
  farthest(dance, scene, animations[0]);
  for (const name of ["l_sleeve", "r_sleeve"]) {
    const turn = (scene.getObjectByName(name) as Object3D).getWorldQuaternion(new Quaternion());
    // drawn hanging to the back of an arm that hangs down
    expect(new Vector3(0, 0, -1).applyQuaternion(turn).y).toBeLessThan(-0.9);
  }
});
