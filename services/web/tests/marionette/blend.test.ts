import * as fc from "fast-check";
import { expect, test } from "vitest";
import { ArmBlend } from "../../src/marionette/blend";
import { DirectionAlignment } from "../../src/marionette/handover";
import { ArmRig } from "../../src/marionette/limb-rig";
import { fromRotationVector } from "../../src/motion/rotation";
import { anyPerpendicular, distanceBetween, length } from "../../src/motion/vector";
import { figure, table } from "./figure";

const part = fc.double({ min: -0.5, max: 0.5, noNaN: true });
const place = fc
  .tuple(part, part, part)
  .map((parts) => Float64Array.from(parts))
  .filter((v) => length(v, 0) > 0.3);
const weights = fc.double({ min: 0, max: 1, noNaN: true });
const rig = new ArmRig(figure, 0, table);

test("between the dance's way of reaching a place and the marionette's, the tip is exact; at the ends it is either", () => {
  fc.assert(
    fc.property(fc.array(part, { minLength: 6, maxLength: 6 }), place, weights, (swung, target, weight) => {
      const dance = new Float64Array(12),
        bent = new Float64Array(12),
        out = new Float64Array(12);
      const own = new Float64Array(3),
        normal = new Float64Array(3),
        direction = new Float64Array(3),
        tip = new Float64Array(3);
      const turn = new Float64Array(4),
        blend = new ArmBlend(rig);
      fromRotationVector(dance, 0, swung[0], swung[1], swung[2]);
      fromRotationVector(dance, 4, -0.8 + swung[3], 0, 0);
      fromRotationVector(dance, 8, swung[4], 0, swung[5]);
      rig.tipTarget(own, 0, dance, 0);
      rig.targetDirection(direction, 0, target, 0);
      anyPerpendicular(normal, 0, direction, 0);
      const reach = length(target, 0);
      rig.bendJoints(bent, 0, reach, rig.arm.gravityBend(reach, 0));
      new DirectionAlignment().update(turn, 0, own, target, 0.5);
      blend.blend(out, 0, dance, 0, bent, target, turn, normal, weight, 0);
      for (const at of [0, 4, 8]) expect(Math.hypot(...out.subarray(at, at + 4))).toBeCloseTo(1, 9);
      if (weight === 0) expect(out).toEqual(dance);
      else {
        rig.tipTarget(tip, 0, out, 0);
        expect(distanceBetween(tip, 0, target, 0)).toBeLessThan(1e-9);
      }
      blend.blend(out, 0, dance, 0, bent, target, turn, normal, 1, 10);
      expect([...out.subarray(4)]).toEqual([...bent.subarray(4)]);
    }),
  );
});
