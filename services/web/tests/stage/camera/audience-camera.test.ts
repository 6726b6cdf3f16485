import { Vector3 } from "three";
import { describe, expect, test } from "vitest";
import type { AudienceCamera, Framing } from "../../../src/stage/camera/audience-camera";
import { MIN_ASPECT } from "../../../src/stage/camera/view";
import { createCamera, pixelsAbove, run, yaw } from "./framed-camera";

describe("framing", () => {
  test.each([300, 400, 600, 900, 1400])(
    "shows head and feet between header and transport, %d pixels high",
    (height) => {
      const audience = createCamera("desktop", 1.6 * height, height);
      expect(pixelsAbove(audience, 0, height)).toBeGreaterThan(110);
      expect(pixelsAbove(audience, 1.75, height)).toBeLessThan(height * 0.85);
    },
  );

  test.each([320, 360, 430])("shows the puppet larger on a phone in landscape, %d pixels high", (height) => {
    const [sideways, desktop] = [
      createCamera("sideways", 2 * height, height),
      createCamera("desktop", 2 * height, height),
    ];
    expect(pixelsAbove(sideways, 0, height)).toBeGreaterThan(66);
    expect(pixelsAbove(sideways, 1.75, height)).toBeLessThan(height * 0.85);
    expect(pixelsAbove(sideways, 1.75, height) - pixelsAbove(sideways, 0, height)).toBeGreaterThan(
      pixelsAbove(desktop, 1.75, height) - pixelsAbove(desktop, 0, height),
    );
  });

  test.each([640, 740, 844])("shows the feet above the dock of a phone, %d pixels high", (height) => {
    const audience = createCamera("phone", 360, height);
    expect(pixelsAbove(audience, 0, height)).toBeGreaterThan(214);
    expect(pixelsAbove(audience, 1.75, height)).toBeLessThan(height - 80);
  });

  test("makes the puppet smaller on a phone and lifts it above a sheet", () => {
    const size = (framing: Framing) =>
      pixelsAbove(createCamera(framing, 400, 800), 1.75, 800) - pixelsAbove(createCamera(framing, 400, 800), 0, 800);
    expect(size("phone")).toBeLessThan(size("desktop"));
    expect(pixelsAbove(createCamera("sheet", 400, 800), 0, 800)).toBeGreaterThan(
      pixelsAbove(createCamera("phone", 400, 800), 0, 800) + 50,
    );
  });

  test.each([
    [844, 420],
    [844, 340],
    [640, 417],
    [640, 360],
  ])("shows a performer between header and sheet, %d pixels high, sheet %d", (height, sheet) => {
    const audience = createCamera("sheet", 390, height);
    audience.setFraming("sheet", height, sheet);
    audience.update(0, 0);
    expect(pixelsAbove(audience, 0, height)).toBeGreaterThan(sheet);
    expect(pixelsAbove(audience, 1.75, height)).toBeLessThan(height - 75);
  });

  test("shows at least the head above a sheet that leaves little room", () => {
    const audience = createCamera("sheet", 390, 640);
    audience.setFraming("sheet", 640, 486);
    audience.update(0, 0);
    expect(pixelsAbove(audience, 1.55, 640)).toBeGreaterThan(486);
    expect(pixelsAbove(audience, 1.75, 640)).toBeLessThan(640 - 75);
  });

  test.each([340, 420, 490])("shows what the motion's camera shows above a sheet, %d pixels high", (sheet) => {
    const [width, height, eye, fov] = [390, 844, 5, 0.45];
    // The whole view of the motion's camera, from its top to its bottom, at the distance of its target.
    const [top, bottom] = [1, -1].map((side) => 1.1 + side * eye * Math.tan(fov / 2));
    const audience = createCamera("sheet", width, height);
    audience.reducedMotion = false;
    const motionCamera = [0, 1.1, eye, 0, 1.1, 0, fov];
    const runFor = (seconds: number) => {
      for (let at = 0; at < seconds; at += 1 / 60) audience.update(1 / 60, 0, motionCamera);
    };
    audience.setFraming("sheet", height, sheet);
    runFor(3);
    expect(pixelsAbove(audience, bottom, height)).toBeGreaterThan(sheet - 1);
    expect(pixelsAbove(audience, top, height)).toBeLessThan(height + 1);
    expect(pixelsAbove(audience, 1.1, height)).toBeCloseTo((height + sheet) / 2, 0);
    // as before once the sheet is closed, and not at once
    const before = pixelsAbove(audience, 1.1, height);
    audience.setFraming("phone", height);
    runFor(1 / 60);
    expect(Math.abs(pixelsAbove(audience, 1.1, height) - before)).toBeLessThan(40);
    runFor(3);
    expect(pixelsAbove(audience, 1.1, height)).toBeCloseTo(height / 2, 0);
  });

  test("shows a performer of twice the size in the same picture", () => {
    for (const y of [0, 0.9, 1.75]) {
      expect(pixelsAbove(createCamera("desktop", 800, 600, 2), 2 * y, 600)).toBeCloseTo(
        pixelsAbove(createCamera("desktop", 800, 600), y, 600),
        6,
      );
    }
  });

  test("eases a change, or applies it at once with reduced motion", () => {
    const [calm, eased] = [createCamera("desktop", 800, 900), createCamera("desktop", 800, 900)];
    const before = eased.camera.position.z;
    eased.reducedMotion = false;
    for (const audience of [calm, eased]) {
      audience.setFraming("phone", 900);
      audience.update(1 / 60, 0);
    }
    expect(eased.camera.position.z).toBeGreaterThan(before);
    expect(eased.camera.position.z).toBeLessThan(before + 0.2 * (calm.camera.position.z - before));
    run(eased, 3);
    expect(eased.camera.position.z).toBeCloseTo(calm.camera.position.z, 3);
  });
});

describe("orbit", () => {
  test("is limited to each side and keeps the performer centred", () => {
    const audience = createCamera("desktop", 800, 900);
    audience.reducedMotion = false;
    audience.orbit(0.2, 0);
    audience.update(0, 0);
    expect(yaw(audience)).toBeCloseTo(0.2, 6);
    audience.orbit(9, 9);
    audience.update(0, 0);
    expect(yaw(audience)).toBeCloseTo((25 * Math.PI) / 180, 6);
    expect(new Vector3(0, 1.005, 0).project(audience.camera).x).toBeCloseTo(0, 6);
    expect(new Vector3(0, 1.005, 0).project(audience.camera).y).toBeCloseTo(0, 6);
    audience.orbit(-9, -9);
    audience.update(0, 0);
    expect(yaw(audience)).toBeCloseTo((-25 * Math.PI) / 180, 6);
    expect(audience.camera.position.y).toBeGreaterThan(0.2);
  });

  test("counts as a custom view until it has sprung back", () => {
    const audience = createCamera("desktop", 800, 900);
    audience.reducedMotion = false;
    expect(audience.isCustomView).toBe(false);
    audience.orbit(0.1, 0);
    run(audience, 3.9);
    expect(audience.isCustomView).toBe(true);
    run(audience, 5);
    expect(audience.isCustomView).toBe(false);
    audience.update(1 / 60, 0, [2, 1.6, 1, 0, 1.1, 0.2, 0.8]);
    expect([audience.followsMotionCamera, audience.isCustomView]).toEqual([true, true]);
  });

  test("springs back four seconds after the last drag", () => {
    const audience = createCamera("desktop", 800, 900);
    audience.reducedMotion = false;
    audience.orbit(0.3, 0.1);
    run(audience, 3.9);
    expect(yaw(audience)).toBeCloseTo(0.3, 6);
    audience.orbit(0, 0);
    run(audience, 3.9);
    expect(yaw(audience)).toBeCloseTo(0.3, 6);
    run(audience, 4);
    expect(Math.abs(yaw(audience))).toBeLessThan(0.01);
  });
});

test("the camera steps back from outstretched hands by an eighth at most", () => {
  const audience = createCamera("desktop", 800, 900);
  audience.reducedMotion = false;
  const near = audience.camera.position.z;
  run(audience, 5, 0.8);
  expect(audience.camera.position.z).toBeCloseTo(near, 6);
  run(audience, 5, 3);
  expect(audience.camera.position.z / near).toBeCloseTo(1.12, 3);
  run(audience, 12, 0.2);
  expect(audience.camera.position.z / near).toBeCloseTo(1, 3);
});

test("what the motion's camera shows of several performers is between the panels", () => {
  const [width, height, eye, fov] = [900, 600, 8, 0.6];
  const audience = createCamera("desktop", width, height);
  audience.reducedMotion = false;
  audience.coveredSides = { left: 60, right: 356, width };
  audience.placePerformers([
    { x: -0.8, z: 0 },
    { x: 0.8, z: 0 },
  ]);
  for (let t = 0; t < 3; t += 1 / 60) audience.update(1 / 60, 0, [0, 1, eye, 0, 1, 0, fov]);
  // The sides of the narrowest picture that the camera was recorded for.
  const half = eye * Math.tan(fov / 2) * MIN_ASPECT;
  const pixels = (x: number) => (new Vector3(x, 1, 0).project(audience.camera).x * 0.5 + 0.5) * width;
  expect(pixels(-half)).toBeGreaterThan(60 - 1);
  expect(pixels(half)).toBeLessThan(width - 356 + 1);
  expect(pixels(0)).toBeCloseTo((60 + width - 356) / 2, 0);
});

describe("a single performer", () => {
  const middle = (audience: AudienceCamera, width: number) =>
    (new Vector3(0, 1, 0).project(audience.camera).x * 0.5 + 0.5) * width;

  test("is centred in the free area if a panel would cover the centre", () => {
    const audience = createCamera("sideways", 667, 375);
    audience.coveredSides = { left: 0, right: 340, width: 667 };
    audience.update(0, 0);
    expect(middle(audience, 667)).toBeCloseTo((667 - 340) / 2, 6);
    audience.coveredSides = { left: 0, right: 112, width: 667 };
    audience.update(0, 0);
    expect(middle(audience, 667)).toBeCloseTo(667 / 2, 6);
  });

  test("moves there smoothly, and the next motion starts there", () => {
    const audience = createCamera("sideways", 667, 375);
    audience.reducedMotion = false;
    audience.coveredSides = { left: 0, right: 340, width: 667 };
    audience.update(1 / 60, 0);
    expect(middle(audience, 667)).toBeGreaterThan(667 / 2 - 60);
    run(audience, 3);
    expect(middle(audience, 667)).toBeCloseTo((667 - 340) / 2, 1);
    audience.cut();
    audience.update(1 / 60, 0);
    expect(middle(audience, 667)).toBeCloseTo((667 - 340) / 2, 2);
  });
});
