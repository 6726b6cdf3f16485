import {
  DirectionalLight,
  Group,
  InstancedBufferAttribute,
  InstancedBufferGeometry,
  InstancedMesh,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  PerspectiveCamera,
  PlaneGeometry,
  Scene,
} from "three";
import { beforeEach, expect, test } from "vitest";
import { SceneWatcher } from "../../../src/stage/rendering/scene-watcher";

let scene: Scene;
let camera: PerspectiveCamera;
let watcher: SceneWatcher;
let further: number[];

beforeEach(() => {
  scene = new Scene();
  camera = new PerspectiveCamera();
  watcher = new SceneWatcher();
  further = [1, 2];
  scene.add(new Group().add(new Mesh(new PlaneGeometry(), new MeshBasicMaterial())), camera);
});

function hasChanged(): boolean {
  scene.updateMatrixWorld();
  return watcher.hasChanged(scene, camera, further);
}

/** Draw the scene, make a change, and return whether it is noticed; afterwards the scene is drawn and still again. */
function isNoticed(change: () => void): boolean {
  hasChanged();
  watcher.markDrawn();
  expect(hasChanged()).toBe(false);
  change();
  const noticed = hasChanged();
  watcher.markDrawn();
  expect(hasChanged()).toBe(false);
  return noticed;
}

test("a scene that was never drawn has changed", () => {
  expect(hasChanged()).toBe(true);
});

test("movements of objects, of their parents and of the camera are noticed", () => {
  const [group] = scene.children;
  expect(isNoticed(() => (group.position.x += 0.001))).toBe(true);
  expect(isNoticed(() => group.children[0].rotateY(0.01))).toBe(true);
  expect(isNoticed(() => (camera.position.z += 0.01))).toBe(true);
  expect(
    isNoticed(() => {
      camera.zoom = 1.1;
      camera.updateProjectionMatrix();
    }),
  ).toBe(true);
});

test("objects that come, go, hide or take another's place are noticed", () => {
  const [group] = scene.children;
  const [mesh] = group.children;
  expect(isNoticed(() => (mesh.visible = false))).toBe(true);
  expect(isNoticed(() => (mesh.visible = true))).toBe(true);
  expect(isNoticed(() => group.remove(mesh))).toBe(true);
  expect(isNoticed(() => group.add(mesh))).toBe(true);
  expect(isNoticed(() => group.remove(mesh).add(mesh.clone()))).toBe(true);
});

test("an object is told from another after many thousands of objects", () => {
  const [group] = scene.children;
  let last = new Mesh();
  while (last.id < 20_000) last = new Mesh();
  group.add(last);
  expect(isNoticed(() => group.remove(last).add(new Mesh()))).toBe(true);
});

test("lights, morphs, instances and further numbers are noticed", () => {
  const light = new DirectionalLight();
  const face = new Mesh(new PlaneGeometry(), new MeshBasicMaterial());
  face.morphTargetInfluences = [0, 0];
  const bars = new InstancedMesh(new PlaneGeometry(), new MeshBasicMaterial(), 2);
  const threads = new InstancedBufferGeometry();
  const tops = new InstancedBufferAttribute(new Float32Array(6), 3);
  threads.setAttribute("top", tops);
  scene.add(light, face, bars, new Mesh(threads, new MeshBasicMaterial()));
  expect(isNoticed(() => light.color.set("#f00"))).toBe(true);
  expect(isNoticed(() => (light.intensity = 2))).toBe(true);
  expect(isNoticed(() => (face.morphTargetInfluences = [0, 0.5]))).toBe(true);
  expect(isNoticed(() => bars.setMatrixAt(1, new Matrix4().makeTranslation(1, 0, 0)))).toBe(true);
  expect(isNoticed(() => (bars.count = 1))).toBe(true);
  expect(isNoticed(() => tops.setX(1, 1))).toBe(true);
  expect(isNoticed(() => (further = [1, 3]))).toBe(true);
});

test("movements that end slowly come to an end, but add up", () => {
  const [group] = scene.children;
  expect(isNoticed(() => (group.position.x += 0.00005))).toBe(false);
  watcher.markDrawn();
  let noticed = false;
  for (let step = 0; step < 10; step++) {
    group.position.x += 0.00005;
    noticed ||= hasChanged();
  }
  expect(noticed).toBe(true);
});
