import { expect, test } from "vitest";
import { Plane, verticalNormal } from "../../src/marionette/plane";
import { dot, length, unit } from "../../src/motion/vector";
import { golden } from "./golden";

test("the plane follows as the golden vectors say, and the tip stays in it", () => {
  const { start, up, seconds, steps } = golden.plane;
  const plane = new Plane();
  const direction = new Float64Array(3), gravity = Float64Array.from(up);
  steps.forEach(({ target, normal }, i) => {
    const place = Float64Array.from(target);
    unit(direction, 0, place, 0);
    if (i === 0) plane.start(Float64Array.from(start), direction);
    plane.follow(direction, length(place, 0), gravity, seconds);
    expect(Math.abs(dot(plane.normal, 0, direction, 0))).toBeLessThan(1e-9);
    for (let k = 0; k < 3; k++) expect(Math.abs(plane.normal[k] - normal[k])).toBeLessThan(1e-9);
  });
});

test("on the axis there is no vertical plane to go to", () => {
  const up = Float64Array.of(0, 1, 0), out = Float64Array.of(7, 8, 9);
  expect(verticalNormal(out, 0, Float64Array.of(0, -1, 0), 0, up, 0)).toBe(false);
  expect([...out]).toEqual([7, 8, 9]);
  const plane = new Plane(), down = Float64Array.of(0, -1, 0);
  plane.start(Float64Array.of(-0.6, 0, 0.8), down);
  for (let i = 0; i < 60; i++) plane.follow(down, 0.7, up, 1 / 60);
  expect(plane.normal[0]).toBeCloseTo(-0.6, 12);
  expect(plane.normal[2]).toBeCloseTo(0.8, 12);
});
