import { DirectionalLight, type Object3D, SpotLight, Vector3 } from "three";
import { beforeEach, describe, expect, test } from "vitest";
import type { LightState } from "../../../src/playout/light-state";
import { createLights, type Lights } from "../../../src/stage/scenery/lighting";
import { LOOKS } from "../../../src/stage/scenery/look";

let lights: Lights;
let key: SpotLight, warm: SpotLight, cool: SpotLight;
let fill: DirectionalLight;

beforeEach(() => {
  lights = createLights();
  lights.applyLook(LOOKS.night);
  const is =
    <T extends Object3D>(kind: new () => T) =>
    (createLight: Object3D): createLight is T =>
      createLight instanceof kind;
  [key, warm, cool] = lights.group.children.filter(is(SpotLight));
  [fill] = lights.group.children.filter(is(DirectionalLight));
});

const createLight = (
  share: number,
  place: [number, number, number] = [1, 4, 4],
  colour: [number, number, number] = [1, 0.2, 0.1],
): LightState => ({
  full: 200,
  numbers: [...place, ...colour, 200 * share],
});

/** Return the illuminance at a spot's target and the width of its cone there. */
const thrown = (createLight: SpotLight) => {
  const distance = createLight.position.distanceTo(createLight.target.position);
  return [createLight.intensity / distance ** 2, Math.tan(createLight.angle) * distance];
};

test("without a motion's lights the look's own are used", () => {
  const before = [key, warm, cool].map((createLight) => [
    createLight.intensity,
    ...createLight.position.toArray(),
    createLight.angle,
  ]);
  lights.update([], 0.5);
  expect(
    [key, warm, cool].map((createLight) => [
      createLight.intensity,
      ...createLight.position.toArray(),
      createLight.angle,
    ]),
  ).toEqual(before);
  expect(before[0]).toEqual([118, -1.9, 3.9, 4.1, expect.closeTo(0.36)]);
  expect(
    [key.shadow.camera.near, key.shadow.camera.far].map((createLight) => Math.round(createLight * 10) / 10),
  ).toEqual([2, 9]);
  expect([lights.ambientLevel, fill.intensity]).toEqual([1, 1.04]);
});

describe("a motion's lights", () => {
  test("replace the key and the rims in this order", () => {
    lights.update(
      [
        createLight(1, [1, 4, 4]),
        createLight(1, [2, 4, -2], [0, 1, 0]),
        createLight(1, [-2, 4, -2]),
        createLight(1, [9, 9, 9]),
      ],
      5,
    );
    expect([key, warm, cool].map((createLight) => createLight.position.toArray())).toEqual([
      [1, 4, 4],
      [2, 4, -2],
      [-2, 4, -2],
    ]);
    expect(warm.color.toArray()).toEqual([0, 1, 0]);
    expect([key, warm, cool].map((createLight) => createLight.castShadow)).toEqual([true, false, false]);
  });

  test("at full intensity light like the look's own from any position", () => {
    for (const look of [LOOKS.night, LOOKS.day]) {
      lights.applyLook(look);
      lights.update([], 5);
      const own = thrown(key);
      for (const place of [
        [1, 4, 4],
        [0, 3, 2],
        [-6, 8, 6],
      ] as const) {
        lights.update([createLight(1, [...place])], 5);
        thrown(key).forEach((createLight, at) => expect(createLight).toBeCloseTo(own[at], 6));
      }
      lights.update([createLight(0.25)], 5);
      expect(thrown(key)[0]).toBeCloseTo(own[0] / 4, 6);
    }
  });

  test("are placed in the world frame although the stage moves", () => {
    lights.group.position.set(2, 0, -1);
    lights.group.rotation.y = 1;
    lights.group.updateMatrixWorld(true);
    lights.update([createLight(1, [3, 4, 2])], 5);
    lights.group.updateMatrixWorld(true);
    expect(key.getWorldPosition(new Vector3()).distanceTo(new Vector3(3, 4, 2))).toBeLessThan(1e-9);
  });

  test("that are dark leave a minimum of ambient light", () => {
    lights.update([createLight(0), createLight(0), createLight(0)], 5);
    expect([key, warm, cool].map((createLight) => createLight.intensity)).toEqual([0, 0, 0]);
    expect(lights.ambientLevel).toBeCloseTo(0.2);
    expect(fill.intensity).toBeCloseTo(0.2 * 1.04);
  });

  test("blend in and out evenly", () => {
    const steps: number[] = [];
    let before = key.position.clone();
    const on = () => {
      steps.push(key.position.distanceTo(before));
      before = key.position.clone();
    };
    for (let frame = 0; frame < 60; frame++, on()) lights.update([createLight(0.5)], 1 / 60);
    expect(key.position.toArray()).toEqual([1, 4, 4]);
    for (let frame = 0; frame < 60; frame++, on()) lights.update([], 1 / 60);
    expect(key.position.toArray()).toEqual([-1.9, 3.9, 4.1]);
    expect(key.intensity).toBeCloseTo(118);
    expect(Math.max(...steps)).toBeLessThan(0.1);
    expect(lights.ambientLevel).toBe(1);
  });

  test("at the performer's position are kept at a distance", () => {
    lights.update([createLight(1, [0, 0.9, 0])], 5);
    expect(key.position.distanceTo(key.target.position)).toBeCloseTo(0.8);
    expect(Number.isFinite(key.intensity)).toBe(true);
  });
});
