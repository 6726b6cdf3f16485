import { expect, test } from "vitest";
import { bandsOf, insideBorder } from "../../../src/stage/rendering/edge-bands";

test("bands are as wide as the boxes in them", () => {
  const boxes = [
    { left: 2, top: 0, right: 4, bottom: 1 },
    { left: 0, top: 1, right: 3, bottom: 2 },
  ];
  expect(bandsOf(boxes, 2)).toEqual(boxes);
});

test("a band without boxes is left out", () => {
  const boxes = [
    { left: 0, top: 0, right: 1, bottom: 1 },
    { left: 5, top: 3, right: 6, bottom: 4 },
  ];
  expect(bandsOf(boxes, 4)).toEqual(boxes);
});

test("all of each box is in the bands", () => {
  const boxes = [
    { left: 0.1, top: 0.05, right: 0.3, bottom: 0.62 },
    { left: 0.25, top: 0.4, right: 0.9, bottom: 0.77 },
  ];
  for (const { left, right, top, bottom } of boxes) {
    const bands = bandsOf(boxes, 12).filter((band) => band.top < bottom - 1e-9 && band.bottom > top + 1e-9);
    expect(Math.min(...bands.map((band) => band.top))).toBeLessThanOrEqual(top);
    expect(Math.max(...bands.map((band) => band.bottom))).toBeGreaterThanOrEqual(bottom - 1e-9);
    expect(bands.every((band) => band.left <= left && band.right >= right)).toBe(true);
  }
});

test("pixels at the border are left out, and boxes beyond it", () => {
  const boxes = [
    { left: -0.5, top: 0.1, right: 0.3, bottom: 2 },
    { left: 0.3, top: 0, right: 0.4, bottom: 0.5 },
    { left: 0.2, top: -1, right: 0.4, bottom: 0.01 },
    { left: 1, top: 0.2, right: 1.5, bottom: 0.4 },
  ];
  expect(insideBorder(boxes, 100, 50)).toEqual([
    { left: 0.01, top: 0.1, right: 0.3, bottom: 0.98 },
    { left: 0.3, top: 0.02, right: 0.4, bottom: 0.5 },
  ]);
});
