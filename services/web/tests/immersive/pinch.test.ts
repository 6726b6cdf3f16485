import { Vector3 } from "three";
import { expect, test } from "vitest";
import { Pinch } from "../../src/immersive/pinch";

/** Finger tips at these distances from the thumb, in millimetres. */
function tips(index: number, middle: number) {
  return { thumb: new Vector3(), index: new Vector3(index / 1000, 0, 0), middle: new Vector3(0, middle / 1000, 0) };
}

test("a pinch begins when thumb and index finger meet, and ends when they are apart", () => {
  const pinch = new Pinch();
  const closed = [60, 25, 19, 25, 34, 36, 25].map((distance) => {
    pinch.update(tips(distance, 80));
    return pinch.isClosed;
  });
  expect(closed).toEqual([false, false, true, true, true, false, false]);
});

test("a pinch with the middle finger is one gesture", () => {
  const pinch = new Pinch();
  const actions = [90, 15, 15, 60, 15].map((distance) => pinch.update(tips(90, distance)));
  expect(actions).toEqual([[], ["next performer"], [], [], ["next performer"]]);
  expect(pinch.isClosed).toBe(false);
});

test("a middle finger that joins a pinch is no gesture, nor does it become one as the index finger leaves", () => {
  const pinch = new Pinch();
  const actions = [tips(15, 80), tips(15, 15), tips(60, 15), tips(60, 60), tips(60, 15)].map((all) =>
    pinch.update(all),
  );
  expect(actions).toEqual([[], [], [], [], ["next performer"]]);
});
