import { expect, test } from "vitest";
import { EXPRESSIONS, expressionIndex, type Face, faceExpressionNames } from "../../src/motion/face";
import { EYE_PITCH_RAD, EYE_YAW_RAD, findGazeSource, gazeFrom } from "../../src/motion/gaze";
import { faceOf } from "../avatar/face/faces";

const look = (weights: Record<string, number>) => {
  const pose = faceOf(weights);
  const source = findGazeSource(pose.face);
  return source && gazeFrom(source, pose.weights, { yaw: 9, pitch: 9 });
};

test("a face without a gaze has no source", () => {
  expect(look({ jawOpen: 1, eyeBlinkLeft: 1 })).toBe(null);
});

test("angles come before expressions", () => {
  expect(look({ gazeYaw: 0.3, gazePitch: -0.2, lookLeft: 1, eyeLookUpLeft: 1 })).toEqual({ yaw: 0.3, pitch: -0.2 });
});

test("presets and blend shapes turn the eyes to the performer's left, and up", () => {
  expect(look({ lookLeft: 1 })).toEqual({ yaw: EYE_YAW_RAD, pitch: 0 });
  expect(look({ lookDown: 0.5, lookRight: 0.5 })).toEqual({ yaw: -EYE_YAW_RAD / 2, pitch: -EYE_PITCH_RAD / 2 });
  const shapes = look({ eyeLookOutLeft: 1, eyeLookInRight: 1, eyeLookUpLeft: 0.5, eyeLookUpRight: 0.5 });
  expect(shapes?.yaw).toBeCloseTo(EYE_YAW_RAD, 12);
  expect(shapes?.pitch).toBeCloseTo(EYE_PITCH_RAD / 2, 12);
});

test("faces of tests know the expressions they were made of", () => {
  const { face, weights }: { face: Face; weights: Float64Array } = faceOf({ jawOpen: 0.4 });
  expect(faceExpressionNames(face)).toEqual(["jawOpen"]);
  expect(weights[expressionIndex("jawOpen")]).toBe(0.4);
  expect(weights.length).toBe(EXPRESSIONS.length);
});
