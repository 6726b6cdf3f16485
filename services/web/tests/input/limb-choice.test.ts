import { Ray, Vector3 } from "three";
import { expect, test } from "vitest";
import { chooseLimb, type Reachable } from "../../src/input/limb-choice";

const string = (limb: number, x: number, length = 0.5): Reachable => ({
  limb,
  ring: new Vector3(x, 1, 0),
  top: new Vector3(x, 1 + length, 0),
});
const STRINGS = [string(0, 0.3), string(1, -0.3)];
/** A ray that meets nothing. */
const AWAY = new Ray(new Vector3(0, 1, 2), new Vector3(0, 0, 1));

const reach = (position: Vector3, ray = AWAY, distance = 0.15) => ({ position, ray, distance });

test("the nearest string within reach is chosen", () => {
  expect(chooseLimb(STRINGS, reach(new Vector3(0.25, 1, 0.1)))).toBe(0);
  expect(chooseLimb(STRINGS, reach(new Vector3(-0.25, 1, 0.1)))).toBe(1);
  expect(chooseLimb([string(2, 0.28), ...STRINGS], reach(new Vector3(0.31, 1, 0)))).toBe(0);
});

test("a string is reached anywhere along its thread, and not beyond its ends", () => {
  expect(chooseLimb(STRINGS, reach(new Vector3(0.35, 1.4, 0)))).toBe(0);
  expect(chooseLimb(STRINGS, reach(new Vector3(0.3, 1.7, 0)))).toBe(null);
  expect(chooseLimb(STRINGS, reach(new Vector3(0.3, 0.8, 0)))).toBe(null);
});

test("nothing is chosen out of reach", () => {
  expect(chooseLimb(STRINGS, reach(new Vector3(0, 1, 0.5)))).toBe(null);
  expect(chooseLimb([], reach(new Vector3(0, 1, 0)))).toBe(null);
});

test("a string is chosen from afar by pointing at it, the one in the middle of the ray first", () => {
  const eye = new Vector3(0, 1.2, 2);
  const pointAt = (x: number, y: number) => new Ray(eye, new Vector3(x, y, 0).sub(eye).normalize());
  expect(chooseLimb(STRINGS, reach(eye, pointAt(0.28, 1)))).toBe(0);
  expect(chooseLimb(STRINGS, reach(eye, pointAt(-0.33, 1.3)))).toBe(1);
  expect(chooseLimb(STRINGS, reach(eye, pointAt(0, 1)))).toBe(null);
  expect(chooseLimb([string(0, 0.05), string(1, -0.02)], reach(eye, pointAt(0, 1.2)))).toBe(1);
});

test("a string behind the hand is not pointed at", () => {
  const ray = new Ray(new Vector3(0.3, 1.2, 2), new Vector3(0, 0, 1));
  expect(chooseLimb(STRINGS, reach(ray.origin, ray))).toBe(null);
});

test("a string in reach is taken before one that is pointed at", () => {
  const hand = new Vector3(0.3, 1.1, 0.1);
  const ray = new Ray(hand, new Vector3(-0.3, 1.1, 0).sub(hand).normalize());
  expect(chooseLimb(STRINGS, reach(hand, ray))).toBe(0);
});
