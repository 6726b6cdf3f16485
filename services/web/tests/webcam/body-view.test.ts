import { expect, test } from "vitest";
import { viewBody } from "../../src/webcam/body-view";
import { LANDMARK, LANDMARK_STRIDE } from "../../src/webcam/landmark";
import { ASPECT, detect, hide, SHOULDER_WIDTH_M } from "./detected-body";
import { ARMS_ASIDE, ARMS_DOWN, poseWith, RIGHT_FOREARM_AHEAD } from "./poses";

test("points are in heights of the picture, from its centre", () => {
  const body = detect(ARMS_DOWN, { distance: 2 });
  const view = viewBody(body, ASPECT);
  // 1.2 heights per metre at a distance of one metre.
  expect(view?.scale).toBeCloseTo(0.6, 6);
  expect(view?.shoulderWidth).toBeCloseTo(SHOULDER_WIDTH_M, 6);
  expect(view?.trunk).toBeCloseTo(0.5 * 0.6, 6);
  // The person's left is at the right of the picture.
  expect(view?.left.shoulder.x).toBeCloseTo(0.2 * 0.6, 6);
  expect(view?.right.shoulder.x).toBeCloseTo(-0.2 * 0.6, 6);
  expect(view?.left.wrist.y).toBeLessThan(view?.left.elbow.y ?? -Infinity);
});

test("the scale does not change when the person turns", () => {
  const turned = viewBody(detect(poseWith({ humanoid_root: [0, 0.7, 0] })), ASPECT);
  expect(turned?.scale).toBeCloseTo(0.6, 1);
});

test("shoulders one behind the other give no view", () => {
  expect(viewBody(detect(poseWith({ humanoid_root: [0, Math.PI / 2, 0] })), ASPECT)).toBe(null);
});

test("a hand before the shoulder is nearer to the camera", () => {
  const view = viewBody(detect(RIGHT_FOREARM_AHEAD), ASPECT);
  expect(view?.right.wrist.nearer).toBeCloseTo(0.27, 6);
  expect(view?.left.wrist.nearer).toBeCloseTo(0, 6);
  expect(view?.right.hand.nearer).toBeGreaterThan(0.3);
});

test("a hand outside the picture is not visible, whatever the model guesses", () => {
  const body = detect(ARMS_ASIDE, { distance: 0.9 });
  body.image[LANDMARK.leftWrist * LANDMARK_STRIDE + 3] = 0.99;
  expect(viewBody(body, ASPECT)?.left).toMatchObject({ wristVisibility: 0, armVisibility: 0 });
  const hidden = hide(detect(ARMS_DOWN), 0.3, "rightElbow");
  expect(viewBody(hidden, ASPECT)?.right).toMatchObject({ wristVisibility: 1, armVisibility: 0.3 });
});
