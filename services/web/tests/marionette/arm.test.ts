import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import { Arm, SOLVED, TABLE_BYTES, readTable } from "../../src/marionette/arm";
import { ELBOW_LIMIT, OUTER_RADIUS, WRIST_LIMIT, parseProportions } from "../../src/marionette/proportions";
import { bytes } from "../vectors";
import { golden } from "./golden";

function near(got: ArrayLike<number>, at: number, wanted: number[]): void {
  for (let i = 0; i < wanted.length; i++) expect(Math.abs(got[at + i] - wanted[i])).toBeLessThan(1e-9);
}

describe.each(golden.arms)("the arm $proportions", ({ proportions, table, sha256, inner_radius, solves }) => {
  const data = bytes(table);
  const arm = new Arm(parseProportions(proportions), readTable(data));

  test("its table is the golden one", async () => {
    const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", data));
    expect(Array.from(digest, (byte) => byte.toString(16).padStart(2, "0")).join("")).toBe(sha256);
    expect(Math.abs(arm.inner - inner_radius)).toBeLessThan(1e-9);
  });

  test("it hangs as the golden vectors say", () => {
    const out = new Float64Array(SOLVED);
    for (const { target, azimuth, angles, elbow, wrist, tip } of solves) {
      arm.solve(out, 0, target[0], target[1], target[2]);
      near(out, 0, [azimuth, ...angles, ...elbow, ...wrist, ...tip]);
    }
  });

  test("its tip is exact and its joints within their limits", () => {
    const out = new Float64Array(SOLVED);
    for (let i = 0; i < 5000; i++) {
      // directions and distances on a lattice that repeats nothing
      const height = 2 * ((i * 0.6180339887498949) % 1) - 1, turn = i * 2.399963229728653;
      const reach = arm.inner + (OUTER_RADIUS - arm.inner) * ((i * 0.7548776662466927) % 1);
      const level = Math.sqrt(1 - height * height) * reach;
      const x = level * Math.sin(turn), y = height * reach, z = level * Math.cos(turn);
      arm.solve(out, 0, x, y, z);
      expect(Math.hypot(out[10] - x, out[11] - y, out[12] - z)).toBeLessThan(1e-11);
      const elbow = out[2] - out[1], wrist = out[3] - out[2];
      expect(elbow).toBeGreaterThan(-1e-9);
      expect(elbow).toBeLessThan(ELBOW_LIMIT + 1e-9);
      expect(wrist).toBeGreaterThan(-1e-9);
      expect(wrist).toBeLessThan(WRIST_LIMIT + 1e-9);
    }
  });
});

test("every bend within the limits closes on the tip", () => {
  const { proportions, table } = golden.arms[0];
  const shape = parseProportions(proportions), arm = new Arm(shape, readTable(bytes(table)));
  const unit = fc.double({ min: 0, max: 1, noNaN: true });
  fc.assert(
    fc.property(unit, unit, unit, (far, up, share) => {
      const r = arm.inner + far * (OUTER_RADIUS - arm.inner), beta = (up - 0.5) * Math.PI;
      const out = new Float64Array(3);
      arm.limits(out, 0, r);
      const [low, high] = out;
      const hung = arm.bend(r, beta);
      expect(hung).toBeGreaterThan(low - 1e-12);
      expect(hung).toBeLessThan(high + 1e-12);
      arm.close(out, 0, r, beta, low + share * (high - low));
      const [t0, t1, t2] = out;
      const x = shape.upper * Math.cos(t0) + shape.fore * Math.cos(t1) + shape.hand * Math.cos(t2);
      const y = shape.upper * Math.sin(t0) + shape.fore * Math.sin(t1) + shape.hand * Math.sin(t2);
      expect(Math.hypot(x - r * Math.cos(beta), y - r * Math.sin(beta))).toBeLessThan(1e-11);
      expect(t1 - t0).toBeGreaterThan(-1e-9);
      expect(t1 - t0).toBeLessThan(ELBOW_LIMIT + 1e-9);
      expect(t2 - t1).toBeGreaterThan(-1e-12);
      expect(t2 - t1).toBeLessThan(WRIST_LIMIT + 1e-12);
    }),
  );
});

test("bytes that are no table are refused", () => {
  expect(() => readTable(new Uint8Array(8))).toThrow(RangeError);
  expect(() => readTable(new Uint8Array(TABLE_BYTES).fill(255))).toThrow("0..1");
  expect(() => readTable(new Uint8Array(TABLE_BYTES).fill(0xbc))).toThrow("0..1");
});
