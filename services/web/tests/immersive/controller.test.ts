import { expect, test } from "vitest";
import { Controller, type ControllerState } from "../../src/immersive/controller";

/** State with these buttons pressed, and the thumbstick at `x`. */
function state(pressed: Record<number, number>, x = 0): ControllerState {
  return { axes: [0, 0, x, 0], buttons: [0, 1, 2, 3, 4, 5].map((button) => ({ value: pressed[button] ?? 0 })) };
}

test("trigger or squeeze close the hand, with hysteresis", () => {
  const controller = new Controller();
  const closed = [{ 0: 0.4 }, { 0: 0.6 }, { 0: 0.4 }, { 0: 0.2 }, { 1: 1 }, { 0: 1, 1: 0 }, {}].map((pressed) => {
    controller.update(state(pressed));
    return controller.isClosed;
  });
  expect(closed).toEqual([false, true, true, false, true, true, false]);
});

test("each press of a button is one action", () => {
  const controller = new Controller();
  const actions = [{ 3: 1 }, { 3: 1 }, {}, { 4: 1 }, { 4: 1, 5: 1 }].map((pressed) =>
    controller.update(state(pressed)),
  );
  expect(actions).toEqual([["next performer"], [], [], ["next performer"], ["size"]]);
});

test("each flick of the thumbstick turns once", () => {
  const controller = new Controller();
  const actions = [0.5, 0.8, 0.6, 0.9, 0, -1, 1].map((x) => controller.update(state({}, x)));
  expect(actions).toEqual([[], ["turn right"], [], [], [], ["turn left"], ["turn right"]]);
});

test("a controller without stick and further buttons works", () => {
  const controller = new Controller();
  expect(controller.update({ axes: [], buttons: [{ value: 1 }] })).toEqual([]);
  expect(controller.isClosed).toBe(true);
});
