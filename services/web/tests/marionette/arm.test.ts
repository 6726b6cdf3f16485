import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import { Arm, NUMBERS_PER_ARM, parseBendTable, TABLE_BYTES } from "../../src/marionette/arm";
import { MAX_ELBOW_BEND_RAD, MAX_TIP_DISTANCE, MAX_WRIST_BEND_RAD } from "../../src/marionette/constants";
import { parseProportions } from "../../src/marionette/proportions";
import { decodeBase64 } from "../golden-vectors";
import { golden } from "./golden";

const coordinate = fc.oneof(fc.double({ min: -1.2, max: 1.2, noNaN: true }), fc.constantFrom(0, 1e-170, 1e-20, -1e6));

function expectNear(actual: ArrayLike<number>, at: number, expected: number[], tolerance = 1e-9): void {
  for (let i = 0; i < expected.length; i++) expect(Math.abs(actual[at + i] - expected[i])).toBeLessThan(tolerance);
}

/** Return the angle between two links. */
function linkAngle(a: number[], b: number[]): number {
  const dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  return Math.acos(Math.min(Math.max(dot / Math.hypot(...a) / Math.hypot(...b), -1), 1));
}

describe.each(golden.arms)("the arm $proportions", ({ proportions, table, sha256, inner_radius, solves }) => {
  const data = decodeBase64(table);
  const arm = new Arm(parseProportions(proportions), parseBendTable(data));

  test("parses the golden table", async () => {
    const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", data));
    expect(Array.from(digest, (byte) => byte.toString(16).padStart(2, "0")).join("")).toBe(sha256);
    expect(Math.abs(arm.minTipDistance - inner_radius)).toBeLessThan(1e-9);
  });

  test("solves the golden targets", () => {
    const out = new Float64Array(NUMBERS_PER_ARM),
      angle = new Float64Array(3);
    for (const { target, azimuth, angles, elbow, wrist, tip } of solves) {
      arm.solveArms(out, 0, Float64Array.from(target), 0);
      expectNear(out, 0, [Math.sin(azimuth), Math.cos(azimuth), ...elbow, ...wrist, ...tip]);
      const level = Math.hypot(tip[0], tip[2]);
      arm.solveAngles(angle, 0, arm.clampDistance(Math.hypot(level, tip[1])), Math.atan2(tip[1], level));
      expectNear(angle, 0, angles);
    }
  });

  test("tip is exact, links keep their lengths and joints their limits", () => {
    const out = new Float64Array(NUMBERS_PER_ARM);
    fc.assert(
      fc.property(coordinate, coordinate, coordinate, (x, y, z) => {
        arm.solveArms(out, 0, Float64Array.of(x, y, z), 0);
        const distance = Math.hypot(x, y, z),
          reach = arm.clampDistance(distance);
        // an unreachable target keeps its direction; a target at the shoulder counts as straight below
        const [right, up, ahead] =
          distance < 1e-12 ? [0, -reach, 0] : [x, y, z].map((part) => (part / distance) * reach);
        expectNear(out, 8, [right, up, ahead], 1e-12);
        const { upper, forearm, hand } = arm.proportions;
        const links = [2, 5, 8].map((at) =>
          [0, 1, 2].map((axis) => out[at + axis] - (at > 2 ? out[at - 3 + axis] : 0)),
        );
        links.forEach((link, index) =>
          expect(Math.abs(Math.hypot(...link) - [upper, forearm, hand][index])).toBeLessThan(1e-12),
        );
        expect(linkAngle(links[0], links[1])).toBeLessThan(MAX_ELBOW_BEND_RAD + 1e-9);
        expect(linkAngle(links[1], links[2])).toBeLessThan(MAX_WRIST_BEND_RAD + 1e-9);
        // neither joint bends backwards: each link turns in the same sense
        const [sine, cosine] = out;
        const level = links.map(([a, b, c]) => [a * sine + c * cosine, b]);
        for (let k = 0; k < 2; k++) {
          expect(level[k][0] * level[k + 1][1] - level[k][1] * level[k + 1][0]).toBeGreaterThan(-1e-12);
        }
      }),
      { numRuns: 2000 },
    );
  });
});

test("solving many arms equals solving one by one", () => {
  const { proportions, table, solves } = golden.arms[1];
  const arm = new Arm(parseProportions(proportions), parseBendTable(decodeBase64(table)));
  const targets = Float64Array.from([9, 9, ...solves.flatMap(({ target }) => target)]);
  const all = new Float64Array(1 + NUMBERS_PER_ARM * solves.length),
    single = new Float64Array(NUMBERS_PER_ARM);
  arm.solveArms(all, 1, targets, 2, solves.length);
  solves.forEach((_, index) => {
    arm.solveArms(single, 0, targets, 2 + 3 * index);
    expect(all.subarray(1 + NUMBERS_PER_ARM * index, 1 + NUMBERS_PER_ARM * (index + 1))).toEqual(single);
  });
  expect(all[0]).toBe(0);
});

test("chain closes on the tip for every allowed bend", () => {
  const { proportions, table } = golden.arms[0];
  const shape = parseProportions(proportions),
    arm = new Arm(shape, parseBendTable(decodeBase64(table)));
  const unit = fc.double({ min: 0, max: 1, noNaN: true });
  fc.assert(
    fc.property(unit, unit, unit, (distanceShare, elevationShare, share) => {
      const r = arm.minTipDistance + distanceShare * (MAX_TIP_DISTANCE - arm.minTipDistance),
        beta = (elevationShare - 0.5) * Math.PI;
      const out = new Float64Array(3);
      arm.bendLimits(out, 0, r);
      const [low, high] = out;
      const bend = arm.gravityBend(r, beta);
      expect(bend).toBeGreaterThan(low - 1e-12);
      expect(bend).toBeLessThan(high + 1e-12);
      arm.closeChain(out, 0, r, beta, low + share * (high - low));
      const [t0, t1, t2] = out;
      const x = shape.upper * Math.cos(t0) + shape.forearm * Math.cos(t1) + shape.hand * Math.cos(t2);
      const y = shape.upper * Math.sin(t0) + shape.forearm * Math.sin(t1) + shape.hand * Math.sin(t2);
      expect(Math.hypot(x - r * Math.cos(beta), y - r * Math.sin(beta))).toBeLessThan(1e-11);
      expect(t1 - t0).toBeGreaterThan(-1e-9);
      expect(t1 - t0).toBeLessThan(MAX_ELBOW_BEND_RAD + 1e-9);
      expect(t2 - t1).toBeGreaterThan(-1e-12);
      expect(t2 - t1).toBeLessThan(MAX_WRIST_BEND_RAD + 1e-12);
    }),
  );
});

test("invalid table bytes throw RangeError", () => {
  expect(() => parseBendTable(new Uint8Array(8))).toThrow(RangeError);
  expect(() => parseBendTable(new Uint8Array(TABLE_BYTES).fill(255))).toThrow("0..1");
  expect(() => parseBendTable(new Uint8Array(TABLE_BYTES).fill(0xbc))).toThrow("0..1");
});
