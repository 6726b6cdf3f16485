import * as fc from "fast-check";
import { expect, test } from "vitest";
import { ArmBlend } from "../../src/marionette/blend";
import { DirectionAlignment } from "../../src/marionette/handover";
import { ArmRig } from "../../src/marionette/limb-rig";
import { fromRotationVector } from "../../src/motion/rotation";
import { anyPerpendicular, distanceBetween, length } from "../../src/motion/vector";
import { figure, table } from "./figure";

const part = fc.double({ min: -0.5, max: 0.5, noNaN: true });
const position = fc
  .tuple(part, part, part)
  .map((parts) => Float64Array.from(parts))
  .filter((v) => length(v, 0) > 0.3);
const weights = fc.double({ min: 0, max: 1, noNaN: true });
const rig = new ArmRig(figure, 0, table);

test("tip is exact at every weight; weights 0 and 1 are exact", () => {
  fc.assert(
    fc.property(fc.array(part, { minLength: 6, maxLength: 6 }), position, weights, (angles, target, weight) => {
      const motion = new Float64Array(12),
        solved = new Float64Array(12),
        out = new Float64Array(12);
      const motionTip = new Float64Array(3),
        normal = new Float64Array(3),
        direction = new Float64Array(3),
        tip = new Float64Array(3);
      const turn = new Float64Array(4),
        blend = new ArmBlend(rig);
      fromRotationVector(motion, 0, angles[0], angles[1], angles[2]);
      fromRotationVector(motion, 4, -0.8 + angles[3], 0, 0);
      fromRotationVector(motion, 8, angles[4], 0, angles[5]);
      rig.tipTarget(motionTip, 0, motion, 0);
      rig.targetDirection(direction, 0, target, 0);
      anyPerpendicular(normal, 0, direction, 0);
      const reach = length(target, 0);
      rig.bendJoints(solved, 0, reach, rig.arm.gravityBend(reach, 0));
      new DirectionAlignment().update(turn, 0, motionTip, target, 0.5);
      blend.blend(out, 0, motion, 0, solved, target, turn, normal, weight, 0);
      for (const at of [0, 4, 8]) expect(Math.hypot(...out.subarray(at, at + 4))).toBeCloseTo(1, 9);
      if (weight === 0) expect(out).toEqual(motion);
      else {
        rig.tipTarget(tip, 0, out, 0);
        expect(distanceBetween(tip, 0, target, 0)).toBeLessThan(1e-9);
      }
      blend.blend(out, 0, motion, 0, solved, target, turn, normal, 1, 10);
      expect([...out.subarray(4)]).toEqual([...solved.subarray(4)]);
    }),
  );
});
