import { expect, test } from "vitest";
import { GamepadCapture } from "../../src/input/gamepad-capture";

function capturedControls(...frames: Record<string, number>[]): (string | null)[] {
  const capture = new GamepadCapture();
  return frames.map((frame) => capture.update(new Map(Object.entries(frame))));
}

test("a button is chosen on release, a stick as soon as it is pushed", () => {
  expect(capturedControls({}, { "button:3": 1 }, { "button:3": 1 }, {})).toEqual([null, null, null, "button:3"]);
  expect(capturedControls({}, { "axis:0+": 0.4 }, { "axis:0+": 0.6 })).toEqual([null, null, "axis:0+"]);
});

test("a control pressed while a button is held is chosen with it", () => {
  expect(capturedControls({}, { "button:4": 1 }, { "button:4": 1, "axis:1-": 0.9 })).toEqual([
    null,
    null,
    "button:4 axis:1-",
  ]);
  expect(capturedControls({}, { "button:4": 1 }, { "button:4": 1, "button:6": 1 })).toEqual([
    null,
    null,
    "button:4 button:6",
  ]);
  expect(capturedControls({}, { "axis:1-": 0.9, "button:4": 1 })).toEqual([null, "button:4 axis:1-"]);
});

test("controls pressed before the start are ignored until released", () => {
  expect(capturedControls({ "button:0": 1 }, { "button:0": 1 }, {}, { "button:1": 1 }, {})).toEqual([
    null,
    null,
    null,
    null,
    "button:1",
  ]);
});
