import { Vector3 } from "three";
import { describe, expect, test } from "vitest";
import type { AudienceCamera } from "../../../src/stage/camera/audience-camera";
import { createCamera, pixelsAbove, run } from "./framed-camera";

describe("several performers", () => {
  const [LEFT, RIGHT] = [
    { x: -3, z: 0 },
    { x: 3, z: 0 },
  ];
  const side = (audience: AudienceCamera, x: number, z = 0) => new Vector3(x, 1, z).project(audience.camera).x;

  test.each([
    [1440, 900, "desktop"],
    [844, 390, "sideways"],
    [760, 480, "alone"],
  ] as const)("are all in the picture of %d by %d", (width, height, framing) => {
    const audience = createCamera(framing, width, height);
    audience.placePerformers([LEFT, RIGHT]);
    audience.update(0, 0);
    expect(side(audience, 3.8)).toBeLessThan(1);
    expect(side(audience, -3.8)).toBeGreaterThan(-1);
    expect(pixelsAbove(audience, 0, height) / height).toBeCloseTo(
      pixelsAbove(createCamera(framing, width, height), 0, height) / height,
      2,
    );
  });

  describe("in an upright picture", () => {
    const FOUR = [-2.7, -0.9, 0.9, 2.7].map((x) => ({ x, z: 0 }));
    const withSelection = (one: number | null, audience = createCamera("phone", 390, 844)) => {
      audience.placePerformers(FOUR, one);
      audience.update(0, 0);
      return audience;
    };
    const inView = (audience: AudienceCamera) =>
      FOUR.map(({ x }) => Math.max(Math.abs(side(audience, x - 0.85)), Math.abs(side(audience, x + 0.85))) <= 1);
    const heightOf = (audience: AudienceCamera, height: number) =>
      pixelsAbove(audience, 1.75, height) - pixelsAbove(audience, 0, height);

    test.each([
      [360, 640, "phone", [0, 0]],
      [390, 844, "phone", [0, 0]],
      [768, 1024, "desktop", [96, 96]],
      [600, 800, "alone", [0, 0]],
    ] as const)("take 28%% of its height, %d by %d", (width, height, framing, [left, right]) => {
      for (const selected of [0, 1, null]) {
        const audience = createCamera(framing, width, height);
        audience.coveredSides = { left, right, width };
        expect(heightOf(withSelection(selected, audience), height) / height).toBeGreaterThan(0.28);
      }
    });

    test("are shown with the selected one, or from the middle of the row", () => {
      expect(inView(withSelection(0))).toEqual([true, false, false, false]);
      expect(inView(withSelection(2))).toEqual([false, false, true, false]);
      expect(inView(withSelection(3))).toEqual([false, false, false, true]);
      expect(withSelection(null).camera.position.x).toBe(0);
      expect([withSelection(0).hidesPerformers, withSelection(null).hidesPerformers]).toEqual([true, true]);
    });

    test("are panned to if another one is selected, smoothly", () => {
      const audience = withSelection(0);
      const { x } = audience.camera.position;
      audience.reducedMotion = false;
      audience.placePerformers(FOUR, 2);
      audience.update(1 / 60, 0);
      expect(audience.camera.position.x).toBeGreaterThan(x);
      expect(audience.camera.position.x).toBeLessThan(x + 0.4);
      run(audience, 3);
      expect(inView(audience)).toEqual([false, false, true, false]);
      expect(audience.sideOffset).toBeCloseTo(audience.camera.position.x, 9);
    });

    test("can be dragged along the row, until another one is selected", () => {
      for (const selected of [null, 0]) {
        const audience = withSelection(selected);
        audience.orbit(9, 0);
        withSelection(selected, audience);
        expect(inView(audience)).toEqual([false, false, false, true]);
        expect(new Vector3(audience.sideOffset, 1, 0).project(audience.camera).x).toBeCloseTo(0, 9);
        audience.orbit(-9, 0);
        expect(inView(withSelection(selected, audience))).toEqual([true, false, false, false]);
        expect(inView(withSelection(2, audience))).toEqual([false, false, true, false]);
      }
    });

    test("do not move the camera back for hands outside it", () => {
      const audience = withSelection(null);
      const { z } = audience.camera.position;
      audience.update(1, 3);
      expect(audience.camera.position.z).toBeCloseTo(z, 9);
    });

    test("are all shown in a wide picture", () => {
      expect(inView(withSelection(0, createCamera("desktop", 1440, 900)))).toEqual([true, true, true, true]);
    });
  });

  test("one of them alone is framed like a single performer wherever it is", () => {
    const audience = createCamera("phone", 390, 844);
    const before = audience.camera.position.clone();
    audience.placePerformers([RIGHT]);
    audience.update(0, 0);
    expect(audience.camera.position.distanceTo(before)).toBe(0);
  });

  test("the camera moves back for performers who part, until the next cut", () => {
    const audience = createCamera("alone", 800, 600);
    audience.placePerformers([LEFT, RIGHT]);
    audience.update(0, 0);
    const { distanceScale: distanceBefore } = audience;
    audience.placePerformers([
      { x: -5, z: 0 },
      { x: 5, z: 0 },
    ]);
    audience.update(0, 0);
    const further = audience.distanceScale;
    expect(further).toBeGreaterThan(distanceBefore * 1.4);
    audience.placePerformers([LEFT, RIGHT]);
    audience.update(0, 0);
    expect(audience.distanceScale).toBe(further);
    audience.cut();
    audience.placePerformers([LEFT, RIGHT]);
    audience.update(0, 0);
    expect(audience.distanceScale).toBeCloseTo(distanceBefore, 9);
  });

  test("the nearest is at the distance of a single performer", () => {
    const audience = createCamera("alone", 1600, 600);
    const away = audience.camera.position.z;
    audience.placePerformers([
      { x: 0, z: 2 },
      { x: 0, z: -2 },
    ]);
    audience.update(0, 0);
    expect(audience.camera.position.z - 2).toBeCloseTo(away, 6);
  });

  test("are framed between covered sides; a single one is not moved", () => {
    const audience = createCamera("desktop", 1440, 900);
    audience.coveredSides = { left: 76, right: 356, width: 1440 };
    audience.update(0, 0);
    expect(side(audience, 0)).toBeCloseTo(0, 9);
    audience.placePerformers([LEFT, RIGHT]);
    audience.update(0, 0);
    const pixels = (x: number) => (side(audience, x) * 0.5 + 0.5) * 1440;
    expect(pixels(0)).toBeCloseTo((76 + 1440 - 356) / 2, 6);
    expect(pixels(-3.8)).toBeGreaterThan(76);
    expect(pixels(3.8)).toBeLessThan(1440 - 356);
    // With hardly any room left they use the full width, covered or not.
    audience.coveredSides = { left: 356, right: 356, width: 760 };
    audience.update(0, 0);
    expect(side(audience, 0)).toBeCloseTo(0, 9);
  });
});
