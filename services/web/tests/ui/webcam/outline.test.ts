import { expect, test } from "vitest";
import { outlineOf } from "../../../src/ui/webcam/outline";
import { detect, hide } from "../../webcam/detected-body";
import { ARMS_ASIDE, ARMS_DOWN, LEFT_UP } from "../../webcam/poses";

const [WIDTH, HEIGHT] = [400, 300];

test("the person is seen as in a mirror: the left hand is at the left", () => {
  const { hands } = outlineOf(detect(ARMS_ASIDE, { distance: 3 }), WIDTH, HEIGHT);
  expect(hands.left?.[0]).toBeLessThan(WIDTH / 2);
  expect(hands.right?.[0]).toBeGreaterThan(WIDTH / 2);
  expect((hands.left?.[0] ?? 0) + (hands.right?.[0] ?? 0)).toBeCloseTo(WIDTH, 6);
});

test("a raised hand is above the head", () => {
  const { hands, head } = outlineOf(detect(LEFT_UP, { distance: 4 }), WIDTH, HEIGHT);
  expect(head?.radius).toBeGreaterThan(0);
  expect(hands.left?.[1]).toBeLessThan((head?.at[1] ?? 0) - (head?.radius ?? 0));
});

test("lines end where a landmark is hidden", () => {
  const all = outlineOf(detect(ARMS_DOWN, { distance: 4 }), WIDTH, HEIGHT);
  expect(all.lines.map((line) => line.length)).toEqual([6, 4, 3, 3]);
  const hidden = hide(detect(ARMS_DOWN, { distance: 4 }), 0.1, "leftElbow", "rightWrist", "leftHip", "nose");
  const { lines, hands, head } = outlineOf(hidden, WIDTH, HEIGHT);
  expect(lines.map((line) => line.length)).toEqual([3, 2, 2, 3]);
  expect([hands.right, head]).toEqual([null, null]);
  expect(hands.left).not.toBe(null);
});
