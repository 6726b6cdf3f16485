import { DirectionalLight, Matrix4, PerspectiveCamera, Scene, type WebGLRenderer } from "three";
import { expect, test, vi } from "vitest";
import { LightTable } from "../../../src/stage/puppet/light-table";
import { LOOKS } from "../../../src/stage/scenery/look";

/** Stage with one light and a renderer that counts what it draws. */
function createStage() {
  const light = new DirectionalLight();
  light.position.set(1, 0, 0);
  const scene = new Scene().add(light, light.target);
  const camera = new PerspectiveCamera();
  const render = vi.fn();
  const targets: unknown[] = [];
  const xr = { enabled: true };
  const renderer = { xr, render, getRenderTarget: () => null, setRenderTarget: (to: unknown) => targets.push(to) };
  const table = new LightTable();
  const update = (look = LOOKS.night) => {
    scene.updateMatrixWorld();
    camera.updateMatrixWorld();
    table.update(renderer as unknown as WebGLRenderer, scene, camera, look, new Matrix4());
    return render.mock.calls.length;
  };
  return { light, scene, camera, table, targets, xr, update };
}

test("the table is drawn once while the light stays the same", () => {
  const { light, camera, targets, xr, update } = createStage();
  expect(update()).toBe(1);
  expect(targets.at(-1)).toBeNull();
  expect(xr.enabled).toBe(true);
  camera.position.x += 0.5;
  light.intensity += 0.01;
  expect(update()).toBe(1);
});

test("the table is drawn again for another light, view or look, and after it was lost", () => {
  const { light, scene, camera, table, update } = createStage();
  update();
  light.color.set("#f00");
  expect(update()).toBe(2);
  camera.rotation.y = 0.1;
  expect(update()).toBe(3);
  scene.environmentIntensity = 0.5;
  expect(update()).toBe(4);
  expect(update(LOOKS.day)).toBe(5);
  table.invalidate();
  expect(update(LOOKS.day)).toBe(6);
});

test("changes that are small each, but not together, draw the table again", () => {
  const { light, update } = createStage();
  update();
  for (let step = 0; step < 10; step++) {
    light.intensity += 0.01;
    update();
  }
  expect(update()).toBeGreaterThan(1);
});
