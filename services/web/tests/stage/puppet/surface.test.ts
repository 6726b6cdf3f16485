import fc from "fast-check";
import { Vector3 } from "three";
import { describe, expect, test } from "vitest";
import { ball, box, curve, lathe, type Surface, smoothStep } from "../../../src/stage/puppet/surface";

/** Return the signed volume: positive if triangles wind outwards. */
function volume(surface: Surface): number {
  const { positions, indices } = surface("full");
  const at = (i: number) => new Vector3().fromArray(positions, i * 3);
  let sum = 0;
  for (let i = 0; i < indices.length; i += 3) sum += at(indices[i]).dot(at(indices[i + 1]).cross(at(indices[i + 2])));
  return sum / 6;
}

describe("surfaces", () => {
  test("a curve passes through its rows and is constant beyond its ends", () => {
    const rows = [
      [0, 1, 5],
      [0.5, 3, 4],
      [1, 2, 0],
    ];
    const at = curve(rows);
    for (const [t, ...values] of rows) expect([...at(t)].map((value) => Number(value.toFixed(9)))).toEqual(values);
    expect([...at(-1)]).toEqual([1, 5]);
    expect([...at(9)].map((value) => Number(value.toFixed(9)))).toEqual([2, 0]);
  });

  test("a smooth step runs from 0 to 1 in both directions", () => {
    fc.assert(
      fc.property(fc.double({ min: -2, max: 2, noNaN: true }), (x) => {
        expect(smoothStep(0, 1, x)).toBeCloseTo(1 - smoothStep(1, 0, x), 9);
        expect(smoothStep(0, 1, x)).toBeGreaterThanOrEqual(0);
        expect(smoothStep(0, 1, x)).toBeLessThanOrEqual(1);
      }),
    );
  });

  test("solids have the expected volume", () => {
    expect(Math.abs(volume(ball(new Vector3(), 1, [1, 1, 1], 48)))).toBeCloseTo((4 / 3) * Math.PI, 1);
    const cylinder = lathe(
      new Vector3(),
      new Vector3(0, -2, 0),
      [
        [0, 0.0001],
        [0.0001, 0.5],
        [0.9999, 0.5],
        [1, 0.0001],
      ],
      { columns: 64, rows: 400 },
    );
    expect(Math.abs(volume(cylinder))).toBeGreaterThan(0.97 * Math.PI * 2);
    const cone: [number, number][] = [
      [0, 0],
      [0.9, 0.45],
      [1, 0],
    ];
    const turned = lathe(new Vector3(), new Vector3(0, -2, 0), cone, { columns: 64, rows: "profile" });
    // two cones with a common base at the middle row of the profile
    expect(Math.abs(volume(turned))).toBeCloseTo((Math.PI * 0.9 ** 2 * 2) / 3, 1);
    expect(turned("full").positions.length / 3).toBe(65 * 3);
    expect(volume(box(new Vector3(), [1, 2, 3], 0.4))).toBeCloseTo(6, 6);
  });

  test("normals of a ball are radial", () => {
    const { positions, normals } = ball(new Vector3(), 1)("full");
    for (let i = 0; i < positions.length; i += 3) {
      const along = positions[i] * normals[i] + positions[i + 1] * normals[i + 1] + positions[i + 2] * normals[i + 2];
      expect(Math.abs(along)).toBeGreaterThan(0.96);
    }
  });
});
