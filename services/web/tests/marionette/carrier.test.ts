import { expect, test } from "vitest";
import { Carrier, inverse, type Shoulder, toPlace, toWorld } from "../../src/marionette/carrier";
import { distanceOf, lengthOf, ORIGIN, type Point, rotated, subtract } from "../../src/marionette/point";
import { fromCoordinateAxis } from "../../src/motion/vector";

function shoulder(position: Point, turn = 0): Shoulder {
  const rotation = new Float64Array(4);
  fromCoordinateAxis(rotation, 0, 1, turn);
  return { position, rotation, armLengthM: 0.65, minTipDistance: 0.12 };
}

test("place and position are inverse", () => {
  const one = shoulder([1, 2, 3], 0.7);
  expect(distanceOf(toPlace(one, toWorld(one, [0.2, -0.5, 0.4])), [0.2, -0.5, 0.4])).toBeLessThan(1e-12);
  expect(distanceOf(rotated(inverse(one.rotation), rotated(one.rotation, [1, 2, 3])), [1, 2, 3])).toBeLessThan(1e-12);
});

test("a rigid body carries its points", () => {
  const before = [shoulder(ORIGIN), shoulder([0.7, 0, 0])] as const;
  const swing = shoulder([0.1, 0, 0.2], 0.3);
  const far = rotated(swing.rotation, [0.7, 0, 0]);
  const now = [swing, shoulder([far[0] + 0.1, far[1], far[2] + 0.2], 0.3)] as const;
  const carrier = new Carrier(before, now, 0.3);
  const [x, y, z] = rotated(swing.rotation, [0.2, 0.3, 0.4]);
  expect(distanceOf(carrier.move([0.2, 0.3, 0.4]), [x + 0.1, y, z + 0.2])).toBeLessThan(1e-12);
  for (const side of [0, 1] as const) {
    expect(lengthOf(carrier.slip(side, [0.2, 0.3, 0.4], 1))).toBeLessThan(1e-12);
    expect(lengthOf(carrier.drift(side, 1))).toBeLessThan(1e-12);
  }
});

test("the whole share follows one shoulder, and the other drifts", () => {
  const still = shoulder(ORIGIN);
  const carrier = new Carrier([still, shoulder([0.7, 0, 0])], [still, shoulder([0.8, 0, 0])], 1);
  expect(carrier.move([0.1, 0.2, 0.3])).toEqual([0.1, 0.2, 0.3]);
  expect(distanceOf(carrier.drift(1, 0.1), [1, 0, 0])).toBeLessThan(1e-12);
  const shells = [
    { centre: ORIGIN, inner: 0.1, outer: 0.6 },
    { centre: [0.8, 0, 0] as const, inner: 0.1, outer: 0.6 },
  ] as const;
  expect(carrier.border(shells, 0.1).gaps([0.4, 0, 0])).toHaveLength(5);
});

test("the spread is the difference of both slips", () => {
  const before = [shoulder(ORIGIN), shoulder([0.7, 0, 0], 3)] as const;
  const carrier = new Carrier(before, [shoulder([0.1, 0, 0], 0.2), shoulder([0.6, 0.1, 0], 2.9)], 0.3);
  const [first, second] = ([0, 1] as const).map((side) =>
    rotated(carrier.rotation, carrier.slip(side, [0.2, 0.3, 0.4], 0.1)),
  );
  expect(distanceOf(carrier.spread([0.2, 0.3, 0.4], 0.1), subtract(first, second))).toBeLessThan(1e-12);
});
