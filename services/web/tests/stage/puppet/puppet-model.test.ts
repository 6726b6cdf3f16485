import { expect, test } from "vitest";
import { restPose } from "../../../src/motion/skeleton";
import { createPuppetModel } from "../../../src/stage/puppet/puppet-model";
import { createStandardFigure } from "./figures";

const model = createPuppetModel(createStandardFigure());
const vertices = model.positions.length / 3;

test("the model has every triangle once, with colours, bones and weights", () => {
  expect((model.face.length + model.body.length) / 3).toBeGreaterThan(20_000);
  for (const [values, width] of [
    [model.normals, 3],
    [model.colours, 3],
    [model.bones, 4],
    [model.weights, 4],
    [model.faceUvs, 2],
  ] as const) {
    expect(values.length).toBe(vertices * width);
  }
  expect(Math.max(...model.bones)).toBe(23);
  for (let vertex = 0; vertex < vertices; vertex++) {
    expect(model.weights.subarray(vertex * 4, vertex * 4 + 4).reduce((sum, weight) => sum + weight)).toBeCloseTo(1, 5);
  }
});

test("the face is painted on the front of the head, upright", () => {
  expect(model.face.length).toBeGreaterThan(300);
  let [highest, lowest] = [model.face[0], model.face[0]];
  for (const vertex of model.face) {
    expect(model.positions[vertex * 3 + 1]).toBeGreaterThan(1.4);
    if (model.positions[vertex * 3 + 1] > model.positions[highest * 3 + 1]) highest = vertex;
    if (model.positions[vertex * 3 + 1] < model.positions[lowest * 3 + 1]) lowest = vertex;
  }
  expect(model.faceUvs[highest * 2 + 1]).toBeLessThan(model.faceUvs[lowest * 2 + 1]);
});

test("a sleeve's rotation is a unit quaternion and swings with the pose", () => {
  const pose = restPose();
  const [still, moved] = [new Float64Array(8), new Float64Array(8)];
  model.poseSleeves(pose, 0, still);
  pose.rotations.set([Math.cos(0.6), Math.sin(0.6), 0, 0], 12 * 4);
  model.poseSleeves(pose, 1 / 30, moved);
  for (const turns of [still, moved])
    for (const at of [0, 4]) expect(Math.hypot(...turns.subarray(at, at + 4))).toBeCloseTo(1, 9);
  expect(Math.hypot(...moved.subarray(0, 4).map((value, i) => value - still[i]))).toBeGreaterThan(0.05);
});
