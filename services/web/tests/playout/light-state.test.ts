import { expect, test } from "vitest";
import { SceneTrack } from "../../src/codec/scene";
import { lightStates } from "../../src/playout/light-state";
import { goldenScene } from "../golden-scenes";

test("lights are listed in order, without cameras and unknown lights", () => {
  const [camera, light] = [0, 1].map((which) => SceneTrack.fromDescription(goldenScene(which)));
  const valuesOf = (scene: number) => (scene === 3 ? null : [scene, 0, 0, 1, 1, 1, 2]);
  const states = lightStates([light, camera, light, light], valuesOf);
  expect(states.map((state) => [state.full, state.numbers[0]])).toEqual([
    [light.full, 0],
    [light.full, 2],
  ]);
});
