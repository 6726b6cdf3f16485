import * as fc from "fast-check";
import { expect, test } from "vitest";
import type { Pose } from "../../src/motion/skeleton";
import { ARM_M } from "../../src/webcam/body-figure";
import { SIDES, viewBody } from "../../src/webcam/body-view";
import { handReach } from "../../src/webcam/hand-reach";
import { ASPECT, type DetectionOptions, detect, trueReach } from "./detected-body";
import { ARMS_ASIDE, ARMS_DOWN, LEFT_UP, poseWith, RIGHT_FOREARM_AHEAD } from "./poses";

function reachOf(pose: Pose, side: "left" | "right", options: DetectionOptions = {}) {
  const view = viewBody(detect(pose, options), ASPECT);
  if (!view) throw new Error("The pose shows no shoulders.");
  return handReach(view[side], side, view.scale, ARM_M * (options.modelScale ?? 1));
}

test.each([
  ["arms down", ARMS_DOWN],
  ["arms to the sides", ARMS_ASIDE],
  ["an arm up", LEFT_UP],
])("hands in the plane of the shoulders are where they are: %s", (_, pose) => {
  for (const side of SIDES) {
    const reach = reachOf(pose, side, { distance: 3 });
    trueReach(pose, side).forEach((value, axis) => void expect(reach[axis]).toBeCloseTo(value, 3));
  }
});

test("both hands of a symmetric pose reach alike", () => {
  const [left, right] = SIDES.map((side) => reachOf(ARMS_ASIDE, side, { distance: 3 }));
  left.forEach((value, axis) => void expect(value).toBeCloseTo(right[axis], 9));
  expect(left[0]).toBeGreaterThan(1);
});

test("neither the size of the model nor the place of the person matters", () => {
  const expected = reachOf(RIGHT_FOREARM_AHEAD, "right");
  for (const options of [{ modelScale: 0.7 }, { distance: 3.5 }, { right: 0.4 }]) {
    const reach = reachOf(RIGHT_FOREARM_AHEAD, "right", options);
    reach.forEach((value, axis) => void expect(value).toBeCloseTo(expected[axis], 1));
  }
});

test("a hand towards the camera reaches forwards", () => {
  const [outwards, up, forwards] = reachOf(RIGHT_FOREARM_AHEAD, "right");
  const truth = trueReach(RIGHT_FOREARM_AHEAD, "right");
  expect(outwards).toBeCloseTo(truth[0], 1);
  expect(up).toBeCloseTo(truth[1], 0);
  expect(forwards).toBeGreaterThan(0.7 * truth[2]);
  expect(forwards).toBeLessThanOrEqual(truth[2]);
});

test("no hand is farther than an arm, or behind the camera", () => {
  const angle = fc.double({ min: -3, max: 3, noNaN: true });
  fc.assert(
    fc.property(angle, angle, angle, fc.double({ min: 0.4, max: 4, noNaN: true }), (x, y, z, distance) => {
      const view = viewBody(detect(poseWith({ l_shoulder: [x, y, z] }), { distance }), ASPECT);
      if (!view) return;
      const reach = handReach(view.left, "left", view.scale, ARM_M * 0.6);
      expect(Math.hypot(...reach)).toBeLessThanOrEqual(1.13 + 1e-9);
    }),
  );
});
