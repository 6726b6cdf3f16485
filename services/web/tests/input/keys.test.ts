import { expect, test } from "vitest";
import { directionOf, isDirection, limbOf } from "../../src/input/keys";

test("letters and arrows pull alike; opposite keys cancel; a slant is no faster", () => {
  expect(directionOf(["KeyD"])).toEqual([1, 0, 0]);
  expect(directionOf(["ArrowUp", "KeyW"])).toEqual([0, 1, 0]);
  expect(directionOf(["KeyA", "KeyD", "PageUp"])).toEqual([0, 0, -1]);
  expect(Math.hypot(...directionOf(["KeyW", "KeyD", "KeyQ"]))).toBeCloseTo(1);
  expect(directionOf(["Space"])).toEqual([0, 0, 0]);
});

test("which keys take what", () => {
  expect(["Digit1", "Digit2", "Numpad3", "Digit4", "Digit5"].map(limbOf)).toEqual([1, 0, 3, 2, null]);
  expect([isDirection("KeyQ"), isDirection("KeyL")]).toEqual([true, false]);
});
