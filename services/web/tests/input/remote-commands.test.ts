import { beforeEach, expect, test } from "vitest";
import { type CommandMessage, RemoteCommands } from "../../src/input/remote-commands";
import { recordPageActions } from "./page-actions";

let sent: CommandMessage[];
let done: string[];
let isLimbSelected: boolean;
let commands: RemoteCommands;

beforeEach(() => {
  [sent, done, isLimbSelected] = [[], [], false];
  commands = new RemoteCommands(
    recordPageActions(done),
    () => isLimbSelected,
    (message) => sent.push(message),
  );
});

test("the page runs its own actions at once, and the limbs' realm gets every press", () => {
  expect(commands.press("Space", ["play"], 1, 5)).toBe(true);
  expect(done).toEqual(["play"]);
  expect(commands.press("Digit1", ["take_right_hand"], 1, 6)).toBe(true);
  commands.release("Digit1", 7);
  commands.release("Digit1", 8);
  expect(done).toEqual(["play"]);
  expect(sent).toEqual([
    { type: "press", control: "Space", commands: ["play"], strength: 1, now: 5 },
    { type: "press", control: "Digit1", commands: ["take_right_hand"], strength: 1, now: 6 },
    { type: "release", control: "Digit1", now: 7 },
  ]);
});

test("a held control is sent again only if its strength changes, and seeks when repeated", () => {
  commands.press("pad", ["forward"], 0.5, 0);
  commands.press("pad", ["forward"], 0.5, 16);
  commands.press("pad", ["forward"], 0.75, 32);
  expect(sent.map((message) => ("strength" in message ? message.strength : null))).toEqual([0.5, 0.75]);
  commands.repeat("pad");
  expect(done).toEqual(["forward", "forward"]);
});

test("controls without a command that applies are left to the browser", () => {
  expect(commands.press("ArrowUp", ["held_y+"], 1, 0)).toBe(false);
  expect([commands.isDown("ArrowUp"), sent]).toEqual([false, []]);
  isLimbSelected = true;
  expect(commands.press("ArrowUp", ["held_y+"], 1, 0)).toBe(true);
  expect(commands.isDown("ArrowUp")).toBe(true);
});

test("matching controls are released together, without a message if there are none", () => {
  commands.press("KeyA", ["play"], 1, 0);
  commands.press("pad:0", ["play"], 1, 0);
  sent.length = 0;
  commands.releaseAll((control) => control.startsWith("pad"));
  commands.releaseAll((control) => control.startsWith("pad"));
  expect(sent).toEqual([{ type: "release all", controls: ["pad:0"] }]);
  expect(commands.isDown("KeyA")).toBe(true);
});
