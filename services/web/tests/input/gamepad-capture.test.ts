import { expect, test } from "vitest";
import { GamepadCapture } from "../../src/input/gamepad-capture";

function hear(...frames: Record<string, number>[]): (string | null)[] {
  const capture = new GamepadCapture();
  return frames.map((frame) => capture.update(new Map(Object.entries(frame))));
}

test("a button is meant when it comes up alone, a stick as soon as it is pushed", () => {
  expect(hear({}, { "button:3": 1 }, { "button:3": 1 }, {})).toEqual([null, null, null, "button:3"]);
  expect(hear({}, { "axis:0+": 0.4 }, { "axis:0+": 0.6 })).toEqual([null, null, "axis:0+"]);
});

test("what is pressed while a button is held is meant with it", () => {
  expect(hear({}, { "button:4": 1 }, { "button:4": 1, "axis:1-": 0.9 })).toEqual([null, null, "button:4 axis:1-"]);
  expect(hear({}, { "button:4": 1 }, { "button:4": 1, "button:6": 1 })).toEqual([null, null, "button:4 button:6"]);
  expect(hear({}, { "axis:1-": 0.9, "button:4": 1 })).toEqual([null, "button:4 axis:1-"]);
});

test("what was down before does not count until all has rested", () => {
  expect(hear({ "button:0": 1 }, { "button:0": 1 }, {}, { "button:1": 1 }, {})).toEqual([
    null,
    null,
    null,
    null,
    "button:1",
  ]);
});
