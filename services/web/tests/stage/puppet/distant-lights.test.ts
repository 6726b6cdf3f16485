import { DirectionalLight, PerspectiveCamera, Scene, SpotLight, Vector3 } from "three";
import { expect, test } from "vitest";
import { createDistantLights, LIGHT_COUNT, updateDistantLights } from "../../../src/stage/puppet/distant-lights";

const ORIGIN = new Vector3();

function light(scene: Scene, at = ORIGIN, camera = new PerspectiveCamera()) {
  const lights = createDistantLights();
  scene.updateMatrixWorld();
  camera.updateMatrixWorld();
  updateDistantLights(lights, scene, camera, at);
  return { directions: lights.lightDirections.value, colours: lights.lightColours.value };
}

test("a spot is as strong as at the performer's centre, and fades towards the edge of its cone", () => {
  const spot = new SpotLight("#fff", 100, 0, 0.5, 0.5, 2);
  spot.position.set(0, 5, 0);
  const scene = new Scene().add(spot, spot.target);
  const { directions, colours } = light(scene);
  expect(directions[0].toArray()).toEqual([0, 1, 0]);
  // candela over the square of the distance, as a matt surface reflects it
  expect(colours[0].r).toBeCloseTo(100 / 25 / Math.PI);
  const aside = light(scene, new Vector3(2, 0, 0)).colours[0].r;
  expect(aside).toBeGreaterThan(0);
  expect(aside).toBeLessThan(colours[0].r);
  expect(light(scene, new Vector3(4, 0, 0)).colours[0].r).toBe(0);
});

test("directions are those of the view, and lights that are missing are dark", () => {
  const sun = new DirectionalLight("#f00", 2);
  sun.position.set(3, 0, 0);
  const camera = new PerspectiveCamera();
  camera.rotation.y = Math.PI / 2;
  const { directions, colours } = light(new Scene().add(sun, sun.target), ORIGIN, camera);
  expect(directions[0].z).toBeCloseTo(1);
  expect(colours[0].r).toBeCloseTo(2 / Math.PI);
  expect(colours[0].g).toBe(0);
  for (let missing = 1; missing < LIGHT_COUNT; missing++) expect(colours[missing].getHex()).toBe(0);
});

test("hidden lights and those beyond the fourth do not count", () => {
  const scene = new Scene();
  const lights = Array.from({ length: LIGHT_COUNT + 2 }, () => new DirectionalLight("#fff", Math.PI));
  scene.add(...lights);
  lights[0].visible = false;
  expect(light(scene).colours.map(({ r }) => Math.round(r))).toEqual([1, 1, 1, 1]);
});
