import { expect, test } from "vitest";
import { shellBorder } from "../../src/marionette/common-reach";
import { add, distanceOf, lengthOf, ORIGIN, type Point, scaled } from "../../src/marionette/point";
import { brakingSpeed, keepWithin, limitChange, steer, wallBefore } from "../../src/marionette/steering";

const SECONDS = 1 / 60,
  MAX_CHANGE = 50 * SECONDS;
const shell = { centre: ORIGIN, inner: 0.15, outer: 0.65 };

test("a point in a still shell stays there at a bounded acceleration", () => {
  const border = shellBorder(shell, ORIGIN);
  let point: Point = [0.4, 0, 0],
    velocity: Point = ORIGIN;
  for (let frame = 0; frame < 200; frame++) {
    const angle = Math.floor(frame / 15) * 2.4;
    const aim: Point = [3 * Math.cos(angle), 1, 3 * Math.sin(angle)];
    const steered = steer(point, velocity, aim, border, MAX_CHANGE, SECONDS);
    expect(distanceOf(steered, velocity)).toBeLessThan(MAX_CHANGE * (1 + 1e-9));
    velocity = steered;
    point = add(point, scaled(velocity, SECONDS));
    expect(lengthOf(point)).toBeLessThan(0.655);
    expect(lengthOf(point)).toBeGreaterThan(0.145);
  }
});

test("a point that is far from its border takes the aim", () => {
  const border = shellBorder({ ...shell, outer: 100 }, ORIGIN);
  expect(steer([1, 0, 0], ORIGIN, [0.3, 0.2, 0.1], border, MAX_CHANGE, SECONDS)).toEqual([0.3, 0.2, 0.1]);
});

test("velocities are kept within walls and changes", () => {
  const walls = [
    { normal: [1, 0, 0] as const, speed: 0.2 },
    { normal: [0, 1, 0] as const, speed: 0.5 },
  ];
  expect(keepWithin([3, 2, 1], walls)).toEqual([expect.closeTo(0.2), expect.closeTo(0.5), 1]);
  expect(limitChange(ORIGIN, [3, 4, 0], 1)).toEqual([expect.closeTo(0.6), expect.closeTo(0.8), 0]);
  expect(limitChange(ORIGIN, [0.3, 0.4, 0], 1)).toEqual([0.3, 0.4, 0]);
});

test("a surface in front allows the braking speed, one behind demands the way back", () => {
  const normal = [1, 0, 0] as const;
  expect(wallBefore({ distance: 0.2, normal, retreat: 0 }, MAX_CHANGE, SECONDS).speed).toBe(
    brakingSpeed(0.2, MAX_CHANGE, SECONDS),
  );
  expect(wallBefore({ distance: -0.01, normal, retreat: 0 }, MAX_CHANGE, 0.01).speed).toBe(-1);
});
