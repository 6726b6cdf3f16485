import * as fc from "fast-check";
import { expect, test } from "vitest";
import { MAX_TWIST_LAG_RAD, MAX_TWIST_SPEED_RAD_S } from "../../src/marionette/constants";
import { ArmRig } from "../../src/marionette/limb-rig";
import { TwistLimiter } from "../../src/marionette/twist";
import { conjugate, multiply } from "../../src/motion/rotation";
import { distanceBetween, fromAxisAngle, normalise, unit } from "../../src/motion/vector";
import { figure, table } from "./figure";

const FRAME_S = 1 / 60;
const rig = new ArmRig(figure, 0, table);
const part = fc.double({ min: -1, max: 1, noNaN: true });
const rotation = fc.tuple(part, part, part, part).filter((q) => Math.hypot(...q) > 0.3);
const arm = fc.tuple(rotation, rotation, rotation).map((joints) => {
  const numbers = Float64Array.from(joints.flat());
  for (const at of [0, 4, 8]) normalise(numbers, at);
  return numbers;
});
const turn = fc.double({ min: -3, max: 3, noNaN: true });

/** Return the orientations of the links of an arm. */
function orientations(joints: Float64Array): Float64Array {
  const links = joints.slice();
  for (const at of [4, 8]) multiply(links, at, links, at - 4, joints, at);
  return links;
}

/** Return the joints of the arm with each link twisted about its axis. */
function twisted(joints: Float64Array, twists: number[]): Float64Array {
  const links = orientations(joints),
    direction = new Float64Array(3),
    q = new Float64Array(4),
    out = new Float64Array(12);
  twists.forEach((angle, link) => {
    unit(direction, 0, rig.bones, 3 * link);
    fromAxisAngle(q, 0, direction, 0, angle);
    multiply(links, 4 * link, links, 4 * link, q, 0);
  });
  out.set(links.subarray(0, 4));
  for (const at of [4, 8]) {
    conjugate(q, 0, links, at - 4);
    multiply(out, at, q, 0, links, at);
  }
  return out;
}

/** Return the greatest angle between corresponding rotations of three. */
function maxDistance(a: Float64Array, b: Float64Array): number {
  const cosines = [0, 4, 8].map((at) => Math.abs([0, 1, 2, 3].reduce((sum, i) => sum + a[at + i] * b[at + i], 0)));
  return 2 * Math.acos(Math.min(...cosines, 1));
}

test("limiting twist keeps joint positions", () => {
  fc.assert(
    fc.property(
      fc.array(arm, { minLength: 1, maxLength: 8 }),
      fc.double({ min: 0, max: 1, noNaN: true }),
      (poses, weight) => {
        const limiter = new TwistLimiter(rig.bones),
          shownPositions = new Float64Array(9),
          requestedPositions = new Float64Array(9);
        for (const joints of poses) {
          const shown = joints.slice();
          limiter.limit(shown, 0, weight, FRAME_S);
          rig.jointPositions(shownPositions, 0, shown, 0);
          rig.jointPositions(requestedPositions, 0, joints, 0);
          for (const at of [0, 3, 6])
            expect(distanceBetween(shownPositions, at, requestedPositions, at)).toBeLessThan(1e-7);
          for (const lag of limiter.lagRad) expect(Math.abs(lag)).toBeLessThanOrEqual(MAX_TWIST_LAG_RAD * weight);
          if (weight === 0) expect(shown).toEqual(joints);
        }
      },
    ),
  );
});

test("jump of twist is limited to the maximum speed until a reset", () => {
  fc.assert(
    fc.property(arm, fc.tuple(turn, turn, turn), (joints, twists) => {
      const limiter = new TwistLimiter(rig.bones),
        requested = twisted(joints, twists);
      let shown = joints.slice();
      limiter.limit(shown, 0, 1, FRAME_S);
      expect(shown).toEqual(joints);
      const frames = Math.ceil(Math.max(...twists.map(Math.abs)) / (MAX_TWIST_SPEED_RAD_S * FRAME_S) + 1e-6);
      for (let frame = 0; frame < frames; frame++) {
        const before = shown;
        shown = requested.slice();
        limiter.limit(shown, 0, 1, FRAME_S);
        expect(maxDistance(orientations(before), orientations(shown))).toBeLessThan(
          MAX_TWIST_SPEED_RAD_S * FRAME_S + 1e-6,
        );
      }
      expect(Math.max(...limiter.lagRad.map(Math.abs))).toBeLessThan(1e-9);
      expect(maxDistance(shown, requested)).toBeLessThan(1e-6);
      limiter.reset();
      shown = joints.slice();
      limiter.limit(shown, 0, 1, FRAME_S);
      expect(shown).toEqual(joints);
    }),
  );
});
