import * as fc from "fast-check";
import { PerspectiveCamera, Vector3 } from "three";
import { describe, expect, test } from "vitest";
import {
  type CameraView,
  createView,
  fovForAspect,
  interpolateViews,
  MIN_ASPECT,
  viewFromNumbers,
} from "../../../src/stage/camera/view";

function view(position: number[], gaze: number[], fov: number): CameraView {
  const out = createView();
  viewFromNumbers([...position, ...gaze, fov], out);
  return out;
}

function interpolate(a: CameraView, b: CameraView, share: number): CameraView {
  const out = createView();
  interpolateViews(a, b, share, out);
  return out;
}

const place = fc.array(fc.double({ min: -5, max: 5, noNaN: true }), { minLength: 3, maxLength: 3 });
const views = fc
  .tuple(place, place, fc.double({ min: 0.1, max: 2, noNaN: true }))
  .filter(([position, gaze]) => {
    return new Vector3(...position).distanceTo(new Vector3(...gaze)) > 0.1;
  })
  .map(([position, gaze, fov]) => view(position, gaze, fov));

describe("interpolation", () => {
  test("starts at one view and ends at the other", () => {
    fc.assert(
      fc.property(views, views, (a, b) => {
        for (const [share, expected] of [
          [0, a],
          [1, b],
        ] as const) {
          const actual = interpolate(a, b, share);
          expect(actual.position.distanceTo(expected.position)).toBeLessThan(1e-9);
          expect(actual.gaze.distanceTo(expected.gaze)).toBeLessThan(1e-9);
          expect(actual.fov).toBeCloseTo(expected.fov, 9);
        }
      }),
    );
  });

  test("keeps the distance and elevation between those of the two views", () => {
    fc.assert(
      fc.property(views, views, fc.double({ min: 0, max: 1, noNaN: true }), (a, b, share) => {
        const actual = interpolate(a, b, share);
        const distances = [a, b].map(({ position, gaze }) => position.distanceTo(gaze));
        const distance = actual.position.distanceTo(actual.gaze);
        expect(distance).toBeGreaterThan(Math.min(...distances) - 1e-9);
        expect(distance).toBeLessThan(Math.max(...distances) + 1e-9);
        const rises = [a, b, actual].map(({ position, gaze }) =>
          Math.asin(Math.min(1, Math.max(-1, (position.y - gaze.y) / position.distanceTo(gaze)))),
        );
        expect(rises[2]).toBeGreaterThan(Math.min(rises[0], rises[1]) - 1e-6);
        expect(rises[2]).toBeLessThan(Math.max(rises[0], rises[1]) + 1e-6);
      }),
    );
  });

  test("goes around the performer by the shorter way", () => {
    const [right, left] = [2.8, -2.8].map((azimuth) =>
      view([3 * Math.sin(azimuth), 1, 3 * Math.cos(azimuth)], [0, 1, 0], 0.5),
    );
    const half = interpolate(right, left, 0.5);
    expect(half.position.distanceTo(new Vector3(0, 1, -3))).toBeLessThan(1e-9);
  });
});

describe("field of view", () => {
  test("keeps the height in wide windows, and the width of 4:5 in narrow ones", () => {
    const camera = new PerspectiveCamera();
    for (const [aspect, wide] of [
      [21 / 9, true],
      [16 / 9, true],
      [4 / 3, true],
      [4 / 5, true],
      [2 / 3, false],
      [9 / 19.5, false],
    ] as const) {
      const recorded = 0.7;
      camera.aspect = aspect;
      camera.fov = (fovForAspect(recorded, aspect) * 180) / Math.PI;
      camera.updateProjectionMatrix();
      camera.updateMatrixWorld();
      // At a target 3 m away.
      const side = new Vector3(3 * Math.tan(recorded / 2) * MIN_ASPECT, 0, -3).project(camera).x;
      if (wide) expect(camera.fov).toBeCloseTo((recorded * 180) / Math.PI, 9);
      else expect(side).toBeCloseTo(1, 9);
      expect(side).toBeLessThan(1 + 1e-9);
    }
  });

  test("stays below 180 degrees in any window", () => {
    fc.assert(
      fc.property(
        fc.double({ min: 0.001, max: 3.14, noNaN: true }),
        fc.double({ min: 0.1, max: 5, noNaN: true }),
        (fov, aspect) => {
          const adapted = fovForAspect(fov, aspect);
          expect(adapted).toBeGreaterThan(fov - 1e-12);
          expect(adapted).toBeLessThan(Math.PI);
        },
      ),
    );
  });
});
