import fc from "fast-check";
import { Quaternion, Vector3 } from "three";
import { describe, expect, test } from "vitest";
import { solveThighAngle, toShoulderFrame } from "../../src/input/target-frame";

const part = fc.double({ min: -1, max: 1, noNaN: true });
const vector = fc.tuple(part, part, part).map((xyz) => new Vector3(...xyz));
const rotation = fc
  .tuple(part, part, part, part)
  .filter((q) => Math.hypot(...q) > 0.1)
  .map((q) => new Quaternion(...q).normalize());

describe("targets in the figure's frames", () => {
  test("a hand target converts back to its world position", () => {
    fc.assert(
      fc.property(vector, vector, rotation, (tip, shoulder, chest) => {
        const back = toShoulderFrame(tip, shoulder, chest, 0.7)
          .multiplyScalar(0.7)
          .applyQuaternion(chest)
          .add(shoulder);
        expect(back.distanceTo(tip)).toBeLessThan(1e-9);
      }),
    );
  });

  test("the thigh's angle puts the knee at its height for any pelvis", () => {
    fc.assert(
      fc.property(fc.double({ min: 0.01, max: 2, noNaN: true }), rotation, vector, (angle, pelvis, hip) => {
        const knee = new Vector3(0, -Math.cos(angle), Math.sin(angle))
          .multiplyScalar(0.43)
          .applyQuaternion(pelvis)
          .add(hip);
        expect(solveThighAngle(knee, hip, pelvis, 0.43)).toBeCloseTo(angle, 6);
      }),
    );
  });

  test("straight down is zero; below it the leg goes back continuously", () => {
    const at = (y: number) => solveThighAngle(new Vector3(0, y, 0), new Vector3(), new Quaternion(), 0.4);
    expect(at(-0.4)).toBe(0);
    expect(at(-0.42)).toBeLessThan(0);
    expect(at(-0.42)).toBeCloseTo(-at(-0.38), 9);
    expect(at(5)).toBeCloseTo(Math.PI);
  });
});
