import { describe, expect, test } from "vitest";
import { DIGITAL_INPUTS, SELECTED_LIMB_INPUTS } from "../../../src/input/digital-input";
import { ACTIONS, DEFAULT_MAPPING } from "../../../src/input/mapping";
import { COMMAND_GROUPS, commandName, summarizeCommands } from "../../../src/ui/mapping/command-name";
import { controlName } from "../../../src/ui/mapping/control-name";

test("controls are named as printed on them", () => {
  const names = [
    "KeyW",
    "Digit1",
    "Numpad3",
    "NumpadAdd",
    "ArrowLeft",
    "PageUp",
    "Space",
    "Slash",
    "F2",
    "button:0",
    "button:7",
    "button:30",
    "axis:1-",
    "axis:2+",
    "axis:6+",
    "button:4 axis:1-",
  ].map((control) => controlName(control));
  expect(names).toEqual([
    "W",
    "1",
    "Num 3",
    "Num Add",
    "←",
    "Page Up",
    "Space",
    "/",
    "F2",
    "A",
    "R2",
    "Button 31",
    "Left stick ↑",
    "Right stick →",
    "Axis 7 +",
    "L1 + Left stick ↑",
  ]);
});

describe("commands", () => {
  test("each has a unique name and is listed once", () => {
    const all = [...DIGITAL_INPUTS, ...SELECTED_LIMB_INPUTS, ...ACTIONS];
    expect(new Set(all.map(commandName)).size).toBe(all.length);
    expect(new Set(COMMAND_GROUPS.flat())).toEqual(new Set(all));
    expect(COMMAND_GROUPS.flat()).toHaveLength(all.length);
    expect((["left_hand_z-", "right_leg+", "held_x+", "take_left_leg"] as const).map(commandName)).toEqual([
      "left hand further",
      "right leg up",
      "pull the held string right",
      "take or release the left leg",
    ]);
  });

  test("are summarised on the gamepad drawing", () => {
    const commandsOf = (...controls: string[]) => controls.flatMap((control) => DEFAULT_MAPPING.bindings[control]);
    expect(summarizeCommands(commandsOf("axis:0+", "axis:0-", "axis:1+", "axis:1-"))).toBe("Left hand");
    expect(summarizeCommands(commandsOf("button:6"), 0)).toBe("Nearer");
    expect(summarizeCommands(commandsOf("button:7"), 0)).toBe("Right hand nearer");
    expect(summarizeCommands(commandsOf("button:4 button:6", "button:4 axis:1-", "button:4 axis:1+"), 0)).toBe(
      "Further, left leg",
    );
    expect(summarizeCommands(["play"])).toBe("Play or pause");
    expect(summarizeCommands([])).toBe("");
  });
});
