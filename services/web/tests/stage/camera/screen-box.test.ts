import { PerspectiveCamera, Vector3 } from "three";
import { expect, test } from "vitest";
import { overlaps, projectBox, unionOf } from "../../../src/stage/camera/screen-box";

test("a box has the size on the screen that its extent has at its depth", () => {
  const camera = new PerspectiveCamera(90, 2, 0.1, 100);
  camera.position.set(0, 1, 5);
  camera.updateMatrixWorld();
  // At 5 m a right angle covers a height of 10 m: 100 pixels per metre.
  const box = projectBox(new Vector3(1, 2, 0), { across: 0.5, up: 0.2, down: 0.1 }, camera, 2000, 1000);
  const expected = { left: 1050, top: 380, right: 1150, bottom: 410 };
  for (const side of ["left", "top", "right", "bottom"] as const) expect(box[side]).toBeCloseTo(expected[side], 6);
});

test("boxes overlap if they share area, or would with a margin", () => {
  const box = { left: 10, top: 10, right: 20, bottom: 20 };
  const beside = { left: 20, top: 12, right: 30, bottom: 18 };
  const below = { left: 10, top: 23, right: 20, bottom: 30 };
  expect(overlaps(box, { left: 12, top: 12, right: 14, bottom: 14 })).toBe(true);
  expect([overlaps(box, beside), overlaps(beside, box)]).toEqual([false, false]);
  expect([overlaps(box, beside, 1), overlaps(beside, box, 1)]).toEqual([true, true]);
  expect([overlaps(box, below, 3), overlaps(box, below, 4)]).toEqual([false, true]);
});

test("the union of boxes contains them all", () => {
  const boxes = [
    { left: 1, top: 5, right: 3, bottom: 6 },
    { left: 2, top: 2, right: 9, bottom: 4 },
  ];
  expect(unionOf(boxes)).toEqual({ left: 1, top: 2, right: 9, bottom: 6 });
});
