import fc from "fast-check";
import { describe, expect, test } from "vitest";
import { applyDeadZone, pressedControls, resolveControls } from "../../src/input/gamepad-state";
import { bind, type Command, DEFAULT_MAPPING } from "../../src/input/mapping";
import { createGamepad } from "./gamepads";

const axis = fc.double({ min: -1, max: 1, noNaN: true });
const [L1, L2, A, CROSS_LEFT] = [4, 6, 0, 14];
const inputsOf = (...of: Parameters<typeof createGamepad>) =>
  Object.fromEntries(
    resolveControls(createGamepad(...of), DEFAULT_MAPPING).flatMap(({ commands, strength }) =>
      commands.map((command): [Command, number] => [command, strength]),
    ),
  );

describe("sticks and buttons", () => {
  test("a stick has a dead zone, then rises to 1 with its direction kept", () => {
    fc.assert(
      fc.property(axis, axis, fc.double({ min: 0, max: 0.5, noNaN: true }), (x, y, deadZone) => {
        const [a, b] = applyDeadZone(x, y, deadZone);
        const length = Math.hypot(x, y);
        if (length <= deadZone) expect([a, b]).toEqual([0, 0]);
        expect(Math.hypot(a, b)).toBeLessThanOrEqual(1 + 1e-9);
        expect(a * y - b * x).toBeCloseTo(0, 9);
      }),
    );
    expect(Math.hypot(...applyDeadZone(0.2 + 1e-6, 0, 0.2))).toBeLessThan(1e-5);
    expect(applyDeadZone(1, 0, 0.2)).toEqual([1, 0]);
  });

  test("all are named as controls with their strength", () => {
    const pushed = pressedControls(createGamepad([1, 0, 0, -1], { [L2]: 0.5, [A]: 1 }), 0.16);
    expect([...pushed].sort()).toEqual([
      ["axis:0+", 1],
      ["axis:3-", 1],
      ["button:0", 1],
      ["button:6", 0.5],
    ]);
    expect(pressedControls(createGamepad([0.1, 0.1, -0.1, 0], { [L2]: 0.04 }), 0.16).size).toBe(0);
    expect(pressedControls({ axes: [], buttons: [] }, 0.16).size).toBe(0);
    expect([...pressedControls({ axes: [0, 0, 0, 0, -0.9], buttons: [{ pressed: true, value: 0 }] }, 0)]).toEqual([
      ["button:0", 1],
      ["axis:4-", 0.9],
    ]);
  });
});

describe("under the default mapping", () => {
  test("the left stick moves the left hand and its trigger the depth", () => {
    expect(inputsOf([1, 0, 0, -1], { [L2]: 0.5 })).toEqual({
      "left_hand_x+": 1,
      "left_hand_z+": 0.5,
      "right_hand_y+": 1,
    });
  });

  test("the shoulder button moves the leg and reverses the trigger", () => {
    expect(Object.keys(inputsOf([0.5, -1, 0, 0], { [L1]: 1, [L2]: 1 })).sort()).toEqual(["left_hand_z-", "left_leg+"]);
  });

  test("play and seek need more than half a press", () => {
    expect(inputsOf([0, 0, 0, 0], { [A]: 1, [CROSS_LEFT]: 1 })).toEqual({ play: 1, back: 1 });
    expect(inputsOf([0, 0, 0, 0], { [A]: 0.4 })).toEqual({});
  });
});

test("any control can be bound to any command", () => {
  const mapping = bind(bind(DEFAULT_MAPPING, "button:1", "left_leg+"), "axis:2+", "keep");
  const commands = (...of: Parameters<typeof createGamepad>) =>
    resolveControls(createGamepad(...of), mapping).map(({ control, commands: bound }) => [control, ...bound]);
  expect(commands([0, 0, 0, 0], { 1: 0.2 })).toEqual([["button:1", "left_leg+"]]);
  expect(commands([0, 0, 1, 0])).toEqual([["axis:2+", "right_hand_x+", "keep"]]);
});
