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
  const made = createView();
  viewFromNumbers([...position, ...gaze, fov], made);
  return made;
}

function mixed(a: CameraView, b: CameraView, share: number): CameraView {
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

describe("going over", () => {
  test("begins at the one and ends at the other", () => {
    fc.assert(
      fc.property(views, views, (a, b) => {
        for (const [share, wanted] of [
          [0, a],
          [1, b],
        ] as const) {
          const got = mixed(a, b, share);
          expect(got.position.distanceTo(wanted.position)).toBeLessThan(1e-9);
          expect(got.gaze.distanceTo(wanted.gaze)).toBeLessThan(1e-9);
          expect(got.fov).toBeCloseTo(wanted.fov, 9);
        }
      }),
    );
  });

  test("never comes nearer to what is looked at than the nearer of the two, nor goes over the top", () => {
    fc.assert(
      fc.property(views, views, fc.double({ min: 0, max: 1, noNaN: true }), (a, b, share) => {
        const got = mixed(a, b, share);
        const distances = [a, b].map(({ position, gaze }) => position.distanceTo(gaze));
        const distance = got.position.distanceTo(got.gaze);
        expect(distance).toBeGreaterThan(Math.min(...distances) - 1e-9);
        expect(distance).toBeLessThan(Math.max(...distances) + 1e-9);
        const rises = [a, b, got].map(({ position, gaze }) =>
          Math.asin(Math.min(1, Math.max(-1, (position.y - gaze.y) / position.distanceTo(gaze)))),
        );
        expect(rises[2]).toBeGreaterThan(Math.min(rises[0], rises[1]) - 1e-6);
        expect(rises[2]).toBeLessThan(Math.max(rises[0], rises[1]) + 1e-6);
      }),
    );
  });

  test("goes round the dancer the shorter way, not through", () => {
    const [right, left] = [2.8, -2.8].map((azimuth) =>
      view([3 * Math.sin(azimuth), 1, 3 * Math.cos(azimuth)], [0, 1, 0], 0.5),
    );
    const half = mixed(right, left, 0.5);
    expect(half.position.distanceTo(new Vector3(0, 1, -3))).toBeLessThan(1e-9);
  });
});

describe("in any window", () => {
  test("the height is kept where it is wide, and what 4:5 shows from side to side where it is narrow", () => {
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
      // at a gaze point 3 m away
      const side = new Vector3(3 * Math.tan(recorded / 2) * MIN_ASPECT, 0, -3).project(camera).x;
      if (wide) expect(camera.fov).toBeCloseTo((recorded * 180) / Math.PI, 9);
      else expect(side).toBeCloseTo(1, 9);
      expect(side).toBeLessThan(1 + 1e-9);
    }
  });

  test("however wide it was recorded, it stays a field of view", () => {
    fc.assert(
      fc.property(
        fc.double({ min: 0.001, max: 3.14, noNaN: true }),
        fc.double({ min: 0.1, max: 5, noNaN: true }),
        (fov, aspect) => {
          const seen = fovForAspect(fov, aspect);
          expect(seen).toBeGreaterThan(fov - 1e-12);
          expect(seen).toBeLessThan(Math.PI);
        },
      ),
    );
  });
});
