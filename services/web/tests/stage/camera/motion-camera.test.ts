import { Group, Vector3 } from "three";
import { describe, expect, test } from "vitest";
import { AudienceCamera } from "../../../src/stage/camera/audience-camera";
import { createCamera } from "./framed-camera";

describe("the motion's camera", () => {
  const MOTION_CAMERA = [2, 1.6, 1, 0, 1.1, 0.2, 0.8];

  function createFollowing(aspect = 1.6): AudienceCamera {
    const audience = createCamera("desktop", 900 * aspect, 900);
    audience.reducedMotion = false;
    audience.update(1 / 60, 0, MOTION_CAMERA);
    return audience;
  }

  function expectAt({ camera }: AudienceCamera, [x, y, z]: number[]): void {
    expect(camera.getWorldPosition(new Vector3()).distanceTo(new Vector3(x, y, z))).toBeLessThan(1e-6);
  }

  test("is followed from its first frame", () => {
    const audience = createFollowing();
    expect([audience.hasMotionCamera, audience.followsMotionCamera]).toEqual([true, true]);
    expectAt(audience, MOTION_CAMERA);
    const centre = new Vector3(0, 1.1, 0.2).project(audience.camera);
    expect(Math.hypot(centre.x, centre.y)).toBeLessThan(1e-9);
    expect((audience.camera.fov * Math.PI) / 180).toBeCloseTo(0.8, 9);
    expect(audience.view.fov).toBeCloseTo(0.8, 9);
  });

  test("is widened in a narrow window, unlike the audience view", () => {
    const audience = createFollowing(0.5);
    expect(Math.tan((audience.camera.fov * Math.PI) / 360)).toBeCloseTo((Math.tan(0.4) * 4) / 5 / 0.5, 9);
    expect(audience.view.fov).toBeCloseTo(0.8, 9);
    audience.followMotionCamera(false);
    for (let i = 0; i < 120; i++) audience.update(1 / 60, 0, MOTION_CAMERA);
    expect(audience.camera.fov).toBeCloseTo(26, 9);
  });

  test("is left and resumed smoothly", () => {
    const audience = createFollowing();
    const audienceView = createCamera("desktop", 1440, 900).camera.position;
    for (const [on, end] of [
      [false, audienceView],
      [true, new Vector3(...MOTION_CAMERA.slice(0, 3))],
    ] as const) {
      audience.followMotionCamera(on);
      let before = audience.camera.position.clone();
      let maxStep = 0;
      for (let i = 0; i < 90; i++) {
        audience.update(1 / 60, 0, MOTION_CAMERA);
        maxStep = Math.max(maxStep, audience.camera.position.distanceTo(before));
        before = audience.camera.position.clone();
      }
      expect(audience.camera.position.distanceTo(end)).toBeLessThan(1e-6);
      expect(maxStep).toBeLessThan(0.4);
      expect(audience.followsMotionCamera).toBe(on);
    }
  });

  test("is left by dragging until it is chosen again or a motion starts", () => {
    const audience = createFollowing();
    for (const back of [() => audience.followMotionCamera(true), () => audience.cut()]) {
      audience.orbit(0.1, 0);
      audience.update(1 / 60, 0, MOTION_CAMERA);
      expect([audience.hasMotionCamera, audience.followsMotionCamera]).toEqual([true, false]);
      back();
      audience.update(1 / 60, 0, MOTION_CAMERA);
      expect(audience.followsMotionCamera).toBe(true);
    }
  });

  test("stays unfollowed in the next motion if the user declined it", () => {
    const audience = createFollowing();
    audience.followMotionCamera(false);
    audience.cut();
    audience.update(1 / 60, 0, MOTION_CAMERA);
    expect([audience.hasMotionCamera, audience.followsMotionCamera]).toEqual([true, false]);
    expect(audience.camera.position.distanceTo(new Vector3(...MOTION_CAMERA.slice(0, 3)))).toBeGreaterThan(1);
  });

  test("is not declined by a drag while there is none", () => {
    const audience = createCamera("desktop", 1440, 900);
    audience.reducedMotion = false;
    audience.orbit(0.1, 0);
    expect([audience.hasMotionCamera, audience.followsMotionCamera]).toEqual([false, false]);
    audience.update(1 / 60, 0, MOTION_CAMERA);
    expect(audience.followsMotionCamera).toBe(true);
  });

  test("is not followed by default with reduced motion, and cut to if chosen", () => {
    const audience = createCamera("desktop", 1440, 900);
    audience.update(1 / 60, 0, MOTION_CAMERA);
    expect([audience.hasMotionCamera, audience.followsMotionCamera]).toEqual([true, false]);
    expect(audience.camera.position.distanceTo(createCamera("desktop", 1440, 900).camera.position)).toBeLessThan(1e-9);
    audience.followMotionCamera(true);
    audience.update(1 / 60, 0, MOTION_CAMERA);
    expectAt(audience, MOTION_CAMERA);
  });

  test("blends to the audience view when it ends", () => {
    const audience = createFollowing();
    for (let i = 0; i < 90; i++) audience.update(1 / 60, 0, null);
    expect(audience.followsMotionCamera).toBe(false);
    expect(audience.camera.position.distanceTo(createCamera("desktop", 1440, 900).camera.position)).toBeLessThan(1e-6);
  });

  test("is in the world frame, wherever the rig is", () => {
    const rig = new Group();
    rig.position.set(3, 0.2, -2);
    rig.rotation.y = 1;
    rig.updateMatrixWorld(true);
    const audience = new AudienceCamera();
    rig.add(audience.camera);
    audience.update(1 / 60, 0, MOTION_CAMERA);
    expectAt(audience, MOTION_CAMERA);
    const centre = new Vector3(0, 1.1, 0.2).project(audience.camera);
    expect(Math.hypot(centre.x, centre.y)).toBeLessThan(1e-9);
    audience.followMotionCamera(false);
    for (let i = 0; i < 90; i++) audience.update(1 / 60, 0, MOTION_CAMERA);
    const seen = rig.worldToLocal(audience.view.position.clone());
    expect(seen.distanceTo(audience.camera.position)).toBeLessThan(1e-9);
    expect(audience.camera.position.x).toBeCloseTo(0, 9);
  });
});
