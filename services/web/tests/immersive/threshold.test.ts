import { expect, test } from "vitest";
import { Threshold } from "../../src/immersive/threshold";

test("it switches on at the upper limit and off at the lower one", () => {
  const threshold = new Threshold(0.5, 0.3);
  const states = [0.4, 0.5, 0.45, 0.31, 0.3, 0.4, 0.49, 0.6].map((value) => [threshold.update(value), threshold.isOn]);
  expect(states).toEqual([
    [false, false],
    [true, true],
    [false, true],
    [false, true],
    [false, false],
    [false, false],
    [false, false],
    [true, true],
  ]);
});
