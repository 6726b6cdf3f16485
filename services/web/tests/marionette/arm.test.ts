import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import { Arm, NUMBERS_PER_ARM, parseBendTable, TABLE_BYTES } from "../../src/marionette/arm";
import { MAX_ELBOW_BEND_RAD, MAX_TIP_DISTANCE, MAX_WRIST_BEND_RAD } from "../../src/marionette/constants";
import { parseProportions } from "../../src/marionette/proportions";
import { decodeBase64 } from "../golden-vectors";
import { golden } from "./golden";

const place = fc.oneof(fc.double({ min: -1.2, max: 1.2, noNaN: true }), fc.constantFrom(0, 1e-170, 1e-20, -1e6));

function expectNear(got: ArrayLike<number>, at: number, wanted: number[], tolerance = 1e-9): void {
  for (let i = 0; i < wanted.length; i++) expect(Math.abs(got[at + i] - wanted[i])).toBeLessThan(tolerance);
}

/** The angle between two links. */
function bend(a: number[], b: number[]): number {
  const dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  return Math.acos(Math.min(Math.max(dot / Math.hypot(...a) / Math.hypot(...b), -1), 1));
}

describe.each(golden.arms)("the arm $proportions", ({ proportions, table, sha256, inner_radius, solves }) => {
  const data = decodeBase64(table);
  const arm = new Arm(parseProportions(proportions), parseBendTable(data));

  test("its table is the golden one", async () => {
    const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", data));
    expect(Array.from(digest, (byte) => byte.toString(16).padStart(2, "0")).join("")).toBe(sha256);
    expect(Math.abs(arm.minTipDistance - inner_radius)).toBeLessThan(1e-9);
  });

  test("it hangs as the golden vectors say", () => {
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

  test("its tip is exact, its links keep their lengths, its joints their limits", () => {
    const out = new Float64Array(NUMBERS_PER_ARM);
    fc.assert(
      fc.property(place, place, place, (x, y, z) => {
        arm.solveArms(out, 0, Float64Array.of(x, y, z), 0);
        const size = Math.hypot(x, y, z),
          reach = arm.clampDistance(size);
        // a target out of reach keeps its direction; the shoulder's own place is straight below
        const [right, up, ahead] = size < 1e-12 ? [0, -reach, 0] : [x, y, z].map((part) => (part / size) * reach);
        expectNear(out, 8, [right, up, ahead], 1e-12);
        const { upper, forearm: fore, hand } = arm.proportions;
        const links = [2, 5, 8].map((at) =>
          [0, 1, 2].map((axis) => out[at + axis] - (at > 2 ? out[at - 3 + axis] : 0)),
        );
        links.forEach((link, nth) =>
          expect(Math.abs(Math.hypot(...link) - [upper, fore, hand][nth])).toBeLessThan(1e-12),
        );
        expect(bend(links[0], links[1])).toBeLessThan(MAX_ELBOW_BEND_RAD + 1e-9);
        expect(bend(links[1], links[2])).toBeLessThan(MAX_WRIST_BEND_RAD + 1e-9);
        // neither joint bends the other way: each link is turned on in one sense
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

test("many arms at once are the same as one by one", () => {
  const { proportions, table, solves } = golden.arms[1];
  const arm = new Arm(parseProportions(proportions), parseBendTable(decodeBase64(table)));
  const targets = Float64Array.from([9, 9, ...solves.flatMap(({ target }) => target)]);
  const all = new Float64Array(1 + NUMBERS_PER_ARM * solves.length),
    one = new Float64Array(NUMBERS_PER_ARM);
  arm.solveArms(all, 1, targets, 2, solves.length);
  solves.forEach((_, nth) => {
    arm.solveArms(one, 0, targets, 2 + 3 * nth);
    expect(all.subarray(1 + NUMBERS_PER_ARM * nth, 1 + NUMBERS_PER_ARM * (nth + 1))).toEqual(one);
  });
  expect(all[0]).toBe(0);
});

test("every bend within the limits closes on the tip", () => {
  const { proportions, table } = golden.arms[0];
  const shape = parseProportions(proportions),
    arm = new Arm(shape, parseBendTable(decodeBase64(table)));
  const unit = fc.double({ min: 0, max: 1, noNaN: true });
  fc.assert(
    fc.property(unit, unit, unit, (far, up, share) => {
      const r = arm.minTipDistance + far * (MAX_TIP_DISTANCE - arm.minTipDistance),
        beta = (up - 0.5) * Math.PI;
      const out = new Float64Array(3);
      arm.bendLimits(out, 0, r);
      const [low, high] = out;
      const hung = arm.gravityBend(r, beta);
      expect(hung).toBeGreaterThan(low - 1e-12);
      expect(hung).toBeLessThan(high + 1e-12);
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

test("bytes that are no table are refused", () => {
  expect(() => parseBendTable(new Uint8Array(8))).toThrow(RangeError);
  expect(() => parseBendTable(new Uint8Array(TABLE_BYTES).fill(255))).toThrow("0..1");
  expect(() => parseBendTable(new Uint8Array(TABLE_BYTES).fill(0xbc))).toThrow("0..1");
});
