import * as fc from "fast-check";
import { Group } from "three";
import { describe, expect, test } from "vitest";
import { type CameraView, createView, viewFromNumbers } from "../../../src/stage/camera/view";
import { MAX_SIDE_ANGLE_RAD, Scenery } from "../../../src/stage/scenery/scenery";

/** Return a view from `azimuth` radians around a stage turned by `front`. */
function viewFrom(azimuth: number, front = 0): CameraView {
  const view = createView();
  viewFromNumbers([3 * Math.sin(azimuth + front), 1.5, 3 * Math.cos(azimuth + front), 0, 1, 0, 0.5], view);
  return view;
}

/** Return the angle from which the scenery is seen, in radians. */
function viewingAngle(scenery: Scenery, azimuth: number): number {
  const angle = azimuth - scenery.group.rotation.y;
  return Math.atan2(Math.sin(angle), Math.cos(angle));
}

describe("the scenery", () => {
  test("does not turn in the audience view", () => {
    const scenery = new Scenery();
    for (const degrees of [0, 25, -25, 10]) {
      scenery.update(viewFrom((degrees * Math.PI) / 180), true, 1 / 60);
      expect(scenery.group.rotation.y).toBeCloseTo(0, 12);
    }
  });

  test("stays behind the performer and never moves faster than the camera", () => {
    const path = fc.array(fc.double({ min: -0.2, max: 0.2, noNaN: true }), { minLength: 1, maxLength: 200 });
    fc.assert(
      fc.property(path, (steps) => {
        const scenery = new Scenery();
        let azimuth = 0;
        for (const step of steps) {
          const before = scenery.group.rotation.y;
          azimuth += step;
          scenery.update(viewFrom(azimuth), false, 1 / 60);
          expect(Math.abs(viewingAngle(scenery, azimuth))).toBeLessThan(MAX_SIDE_ANGLE_RAD + 1e-9);
          const turned = scenery.group.rotation.y - before;
          expect(Math.abs(Math.atan2(Math.sin(turned), Math.cos(turned)))).toBeLessThan(Math.abs(step) + 1e-9);
        }
      }),
    );
  });

  test("returns in the audience view", () => {
    const scenery = new Scenery();
    scenery.update(viewFrom(2), false, 1 / 60);
    expect(scenery.group.rotation.y).toBeCloseTo(2 - MAX_SIDE_ANGLE_RAD, 9);
    for (let i = 0; i < 240; i++) scenery.update(viewFrom(0), true, 1 / 60);
    expect(Math.abs(scenery.group.rotation.y)).toBeLessThan(1e-3);
  });

  test("turns relative to a stage that is turned itself", () => {
    const stage = new Group();
    stage.rotation.y = 1.2;
    stage.updateMatrixWorld(true);
    const scenery = new Scenery();
    stage.add(scenery.group);
    scenery.update(viewFrom(0.2, 1.2), false, 1 / 60);
    expect(scenery.group.rotation.y).toBeCloseTo(0, 9);
    scenery.update(viewFrom(1.5, 1.2), false, 1 / 60);
    expect(scenery.group.rotation.y).toBeCloseTo(1.5 - MAX_SIDE_ANGLE_RAD, 9);
  });

  test("moves sideways with the audience view", () => {
    const scenery = new Scenery();
    scenery.update(viewFrom(0), true, 1 / 60, 1.5);
    expect(scenery.group.position.x).toBe(1.5);
    scenery.update(viewFrom(0), true, 1 / 60);
    expect(scenery.group.position.x).toBe(0);
  });
});
