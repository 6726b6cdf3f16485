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
    [390, 844, "phone"],
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

  describe("in a narrow window with one selected", () => {
    const FOUR = [-2.7, -0.9, 0.9, 2.7].map((x) => ({ x, z: 0 }));
    const withSelection = (one: number | null, audience = createCamera("phone", 390, 844)) => {
      audience.placePerformers(FOUR, one);
      audience.update(0, 0);
      return audience;
    };
    const inView = (audience: AudienceCamera) =>
      FOUR.map(({ x }) => Math.max(Math.abs(side(audience, x - 0.85)), Math.abs(side(audience, x + 0.85))) <= 1);

    test("are shown in pairs, and closer", () => {
      expect(inView(withSelection(0))).toEqual([true, true, false, false]);
      expect(inView(withSelection(3))).toEqual([false, false, true, true]);
      expect(inView(withSelection(null))).toEqual([true, true, true, true]);
      expect(withSelection(0).distanceScale).toBeLessThan(0.65 * withSelection(null).distanceScale);
      expect([withSelection(0).hidesPerformers, withSelection(null).hidesPerformers]).toEqual([true, false]);
    });

    test("are panned to only if the selected one is not fully in view, smoothly", () => {
      const audience = withSelection(0);
      const { x } = audience.camera.position;
      expect(withSelection(1, audience).camera.position.x).toBeCloseTo(x, 9);
      audience.reducedMotion = false;
      audience.placePerformers(FOUR, 2);
      audience.update(1 / 60, 0);
      expect(audience.camera.position.x).toBeGreaterThan(x);
      expect(audience.camera.position.x).toBeLessThan(x + 0.4);
      run(audience, 3);
      expect(inView(audience)).toEqual([false, true, true, false]);
    });

    test("are all shown in a wide picture, and two in every picture", () => {
      expect(inView(withSelection(0, createCamera("desktop", 1440, 900)))).toEqual([true, true, true, true]);
      const two = createCamera("phone", 390, 844);
      two.placePerformers(FOUR.slice(1, 3), 0);
      two.update(0, 0);
      expect([two.hidesPerformers, two.camera.position.x]).toEqual([false, 0]);
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
