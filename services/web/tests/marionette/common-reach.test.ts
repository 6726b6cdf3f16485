import { expect, test } from "vitest";
import {
  commonBorder,
  nearestCommonPoint,
  nearestInShell,
  type Shell,
  shellBorder,
} from "../../src/marionette/common-reach";
import { distanceOf, ORIGIN, type Point, subtract } from "../../src/marionette/point";

const first: Shell = { centre: ORIGIN, inner: 0.1, outer: 0.65 };
const second: Shell = { centre: [0.8, 0.1, -0.2], inner: 0.1, outer: 0.6 };
const points: Point[] = [ORIGIN, [2, 0, 0], [0.4, 0.1, 0], [0.8, 0.1, -0.2], [0.4, -3, 0], [-1, 1, 1]];

test.each(points)("the common point nearest to %f, %f, %f is in both shells", (...point) => {
  const nearest = nearestCommonPoint(point, first, second);
  if (!nearest) throw new Error("no common point");
  for (const { centre, inner, outer } of [first, second]) {
    expect(distanceOf(nearest, centre)).toBeGreaterThan(inner - 1e-8);
    expect(distanceOf(nearest, centre)).toBeLessThan(outer + 1e-8);
  }
});

test("shells that do not meet have no common point", () => {
  expect(nearestCommonPoint(ORIGIN, first, { ...second, centre: [1.3, 0, 0] })).toBeNull();
});

test("concentric shells have the border of the smaller one", () => {
  const small = { ...first, outer: 0.5 };
  expect(nearestCommonPoint([0, 0.9, 0], first, small)).toEqual([0, 0.5, 0]);
  expect(commonBorder([first, small], [ORIGIN, ORIGIN]).gaps([0, 0.3, 0])).toHaveLength(4);
});

test("a point outside a shell is moved along its direction", () => {
  expect(nearestInShell(first, [0, 0, 2])).toEqual([0, 0, 0.65]);
  expect(nearestInShell(first, ORIGIN)).toEqual([0, -0.1, 0]);
  expect(nearestInShell(first, [0, 0, 0.3])).toEqual([0, 0, 0.3]);
});

test("gaps are the distances of the surfaces, and retreat with the shells", () => {
  const [outer, inner] = shellBorder(first, [1, 0, 0]).gaps([0.4, 0, 0]);
  expect(outer).toEqual({ distance: expect.closeTo(0.25), normal: [1, 0, 0], retreat: 1 });
  expect(inner.distance).toBeCloseTo(0.3);
  expect(inner.retreat).toBe(-1);
  const moment = 1e-6,
    drift: Point = [0.3, -0.2, 0.5];
  const moved = (shell: Shell): Shell => ({ ...shell, centre: subtract(shell.centre, [-3e-7, 2e-7, -5e-7]) });
  const now = commonBorder([first, second], [drift, drift]).gaps([0.4, 0.3, 0.1]);
  const then = commonBorder([moved(first), moved(second)], [drift, drift]).gaps([0.4, 0.3, 0.1]);
  expect(now).toHaveLength(5);
  for (let nth = 0; nth < 5; nth++)
    expect((then[nth].distance - now[nth].distance) / moment).toBeCloseTo(now[nth].retreat, 4);
});

test("speed is limited relative to each shell, so that a bounded acceleration follows its outer sphere", () => {
  const drift: Point = [1, 0, 0];
  const border = shellBorder({ ...first, outer: 0.5 }, drift);
  expect(border.limitSpeed([2.9, 0, 0], 8)).toEqual([2.9, 0, 0]);
  expect(border.limitSpeed([-4, 0, 0], 8)).toEqual([-1, 0, 0]);
  const both = commonBorder([{ ...first, outer: 0.5 }, second], [drift, ORIGIN]);
  expect(distanceOf(both.limitSpeed([-9, 5, 0], 8), ORIGIN)).toBeLessThanOrEqual(Math.sqrt(8 * 0.6) + 1e-12);
});
