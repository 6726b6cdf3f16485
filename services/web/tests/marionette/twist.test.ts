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

/** The orientations of an arm's links. */
function orientations(joints: Float64Array): Float64Array {
  const links = joints.slice();
  for (const at of [4, 8]) multiply(links, at, links, at - 4, joints, at);
  return links;
}

/** The same arm with its links turned about themselves. */
function twisted(joints: Float64Array, by: number[]): Float64Array {
  const links = orientations(joints),
    direction = new Float64Array(3),
    q = new Float64Array(4),
    out = new Float64Array(12);
  by.forEach((angle, link) => {
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

/** The greatest angle between the same of three rotations. */
function maxDistance(a: Float64Array, b: Float64Array): number {
  const cosines = [0, 4, 8].map((at) => Math.abs([0, 1, 2, 3].reduce((sum, i) => sum + a[at + i] * b[at + i], 0)));
  return 2 * Math.acos(Math.min(...cosines, 1));
}

test("all places are where they are wanted, however the links are turned", () => {
  fc.assert(
    fc.property(
      fc.array(arm, { minLength: 1, maxLength: 8 }),
      fc.double({ min: 0, max: 1, noNaN: true }),
      (all, share) => {
        const spins = new TwistLimiter(rig.bones),
          here = new Float64Array(9),
          there = new Float64Array(9);
        for (const joints of all) {
          const shown = joints.slice();
          spins.limit(shown, 0, share, FRAME_S);
          rig.jointPositions(here, 0, shown, 0);
          rig.jointPositions(there, 0, joints, 0);
          for (const at of [0, 3, 6]) expect(distanceBetween(here, at, there, at)).toBeLessThan(1e-7);
          for (const behind of spins.lagRad) expect(Math.abs(behind)).toBeLessThanOrEqual(MAX_TWIST_LAG_RAD * share);
          if (share === 0) expect(shown).toEqual(joints);
        }
      },
    ),
  );
});

test("links that jump about themselves come over at a bounded speed, and once forgotten at once", () => {
  fc.assert(
    fc.property(arm, fc.tuple(turn, turn, turn), (joints, by) => {
      const spins = new TwistLimiter(rig.bones),
        wanted = twisted(joints, by);
      let shown = joints.slice();
      spins.limit(shown, 0, 1, FRAME_S);
      expect(shown).toEqual(joints);
      const frames = Math.ceil(Math.max(...by.map(Math.abs)) / (MAX_TWIST_SPEED_RAD_S * FRAME_S) + 1e-6);
      for (let frame = 0; frame < frames; frame++) {
        const before = shown;
        shown = wanted.slice();
        spins.limit(shown, 0, 1, FRAME_S);
        expect(maxDistance(orientations(before), orientations(shown))).toBeLessThan(
          MAX_TWIST_SPEED_RAD_S * FRAME_S + 1e-6,
        );
      }
      expect(Math.max(...spins.lagRad.map(Math.abs))).toBeLessThan(1e-9);
      expect(maxDistance(shown, wanted)).toBeLessThan(1e-6);
      spins.reset();
      shown = joints.slice();
      spins.limit(shown, 0, 1, FRAME_S);
      expect(shown).toEqual(joints);
    }),
  );
});
