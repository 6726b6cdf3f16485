import { expect, test } from "vitest";
import { PropMovement } from "../../src/motion/prop-movement";
import { createPropTransform, type PropTransform } from "../../src/motion/props";

const FRAME_S = 1 / 60;
const IN_HAND = { limb: 0, place: [0, 0, 0] };
const ON_FLOOR = { limb: null, place: [1, 2, 0] };

/** Return the transform at this height, turned about y. */
function at(height: number, turn = 0): PropTransform {
  const transform = createPropTransform();
  transform.position[1] = height;
  transform.rotation.set([Math.cos(turn / 2), 0, Math.sin(turn / 2), 0]);
  return transform;
}

test("a prop is at its place from the start, and follows its hand without delay", () => {
  const movement = new PropMovement();
  for (const height of [1, 1.3, 0.4]) expect(movement.moveTo(at(height), IN_HAND, FRAME_S).position[1]).toBe(height);
});

test("a change leads from the last place to the new one, which moves meanwhile", () => {
  const movement = new PropMovement();
  movement.moveTo(at(1), IN_HAND, FRAME_S);
  const heights = Array.from(
    { length: 16 },
    (_, frame) => movement.moveTo(at(2 + 0.01 * frame, 1), ON_FLOOR, FRAME_S).position[1],
  );
  expect(heights[0]).toBeLessThan(1.03);
  for (let frame = 1; frame < heights.length; frame++) {
    expect(heights[frame]).toBeGreaterThan(heights[frame - 1]);
    expect(heights[frame] - heights[frame - 1]).toBeLessThan(0.13);
  }
  expect(heights[15]).toBeCloseTo(2.15, 12);
  expect(movement.transform.rotation[2]).toBeCloseTo(Math.sin(0.5), 12);
});

test("another place on the floor is a change, the same one is not", () => {
  const movement = new PropMovement();
  movement.moveTo(at(0), ON_FLOOR, FRAME_S);
  expect(movement.moveTo(at(1), { ...ON_FLOOR, place: [1, 2, 0] }, FRAME_S).position[1]).toBe(1);
  expect(movement.moveTo(at(2), { ...ON_FLOOR, place: [1, 2, 1] }, FRAME_S).position[1]).toBeLessThan(1.1);
});

test("without time nothing moves, with infinite time it moves at once", () => {
  const movement = new PropMovement();
  movement.moveTo(at(0), IN_HAND, FRAME_S);
  expect(movement.moveTo(at(1), ON_FLOOR, 0).position[1]).toBe(0);
  expect(movement.moveTo(at(1), ON_FLOOR, Infinity).position[1]).toBe(1);
});

test("a prop that was not seen appears at its place", () => {
  const movement = new PropMovement();
  movement.moveTo(at(0), IN_HAND, FRAME_S);
  movement.hide();
  expect(movement.moveTo(at(1), ON_FLOOR, FRAME_S).position[1]).toBe(1);
});
