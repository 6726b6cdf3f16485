import { describe, expect, test } from "vitest";
import { ARM_M } from "../../src/webcam/body-figure";
import { viewBody } from "../../src/webcam/body-view";
import { Calibration, STILL_S } from "../../src/webcam/calibration";
import type { DetectedBody } from "../../src/webcam/landmark";
import { ASPECT, detect, hide, SHOULDER_WIDTH_M } from "./detected-body";
import { ARMS_DOWN, RIGHT_FOREARM_AHEAD } from "./poses";

const FPS = 10;

/** Add the same picture for a time. Return the time afterwards. */
function show(calibration: Calibration, body: DetectedBody | null, from: number, seconds: number): number {
  for (let frame = 0; frame <= seconds * FPS; frame++)
    calibration.add(body && viewBody(body, ASPECT), from + frame / FPS);
  return from + seconds;
}

describe("standing still", () => {
  test.each([1, 0.8])("measures the arms in metres of the model, %d per metre", (modelScale) => {
    for (const distance of [1.2, 2, 3]) {
      const calibration = new Calibration();
      show(calibration, detect(ARMS_DOWN, { distance, modelScale }), 0, STILL_S);
      expect(calibration.stature?.armLength).toBeCloseTo(ARM_M * modelScale, 3);
    }
  });

  test("takes its time, and tells its progress", () => {
    const calibration = new Calibration();
    expect([calibration.stature, calibration.progress]).toEqual([null, 0]);
    show(calibration, detect(ARMS_DOWN), 0, STILL_S / 2);
    expect(calibration.stature).toBe(null);
    expect(calibration.progress).toBeCloseTo(0.5, 6);
    show(calibration, detect(ARMS_DOWN), STILL_S / 2, STILL_S / 2);
    expect(calibration.progress).toBe(1);
  });

  test("begins again after a step, and when nobody is seen", () => {
    const calibration = new Calibration();
    let now = show(calibration, detect(ARMS_DOWN), 0, STILL_S * 0.9);
    now = show(calibration, detect(ARMS_DOWN, { right: 0.3 }), now + 0.1, STILL_S * 0.9);
    expect(calibration.stature).toBe(null);
    now = show(calibration, null, now + 0.1, 0.1);
    expect(calibration.progress).toBe(0);
    show(calibration, detect(ARMS_DOWN), now + 0.1, STILL_S);
    expect(calibration.stature).not.toBe(null);
  });

  test("a breath is no step", () => {
    const calibration = new Calibration();
    for (let frame = 0; frame <= STILL_S * FPS; frame++)
      calibration.add(viewBody(detect(ARMS_DOWN, { right: 0.02 * Math.sin(frame) }), ASPECT), frame / FPS);
    expect(calibration.stature).not.toBe(null);
  });

  test("of a person at a desk, whose arms are not seen, uses the shoulders", () => {
    const calibration = new Calibration();
    const body = hide(detect(ARMS_DOWN, { distance: 0.7 }), 0.1, "leftWrist", "rightWrist");
    show(calibration, body, 0, STILL_S);
    expect(calibration.stature?.armLength).toBeCloseTo(1.5 * SHOULDER_WIDTH_M, 6);
  });

  test("arms that point at the camera are not measured", () => {
    const calibration = new Calibration();
    const body = hide(detect(RIGHT_FOREARM_AHEAD), 0.1, "leftWrist");
    show(calibration, body, 0, STILL_S);
    expect(calibration.stature?.armLength).toBeCloseTo(1.5 * SHOULDER_WIDTH_M, 6);
  });

  test("a hidden shoulder is waited for", () => {
    const calibration = new Calibration();
    show(calibration, hide(detect(ARMS_DOWN), 0.2, "leftShoulder"), 0, 2 * STILL_S);
    expect(calibration.progress).toBe(0);
  });
});

test("it stays until it is reset", () => {
  const calibration = new Calibration();
  const now = show(calibration, detect(ARMS_DOWN), 0, STILL_S);
  const { stature } = calibration;
  show(calibration, detect(ARMS_DOWN, { modelScale: 0.5 }), now, STILL_S);
  expect(calibration.stature).toBe(stature);
  calibration.reset();
  expect([calibration.stature, calibration.progress]).toEqual([null, 0]);
});

test("the size of the person in the picture is kept", () => {
  const calibration = new Calibration();
  show(calibration, detect(ARMS_DOWN, { distance: 2 }), 0, STILL_S);
  expect(calibration.stature?.scale).toBeCloseTo(0.6, 3);
  // The shoulders of the figure are 0.5 m above its hips.
  expect(calibration.stature?.trunk).toBeCloseTo(0.3, 3);
  const seated = new Calibration();
  show(seated, hide(detect(ARMS_DOWN), 0.1, "leftHip"), 0, STILL_S);
  expect(seated.stature?.trunk).toBe(null);
});
