import { beforeEach, expect, test } from "vitest";
import { CommandDispatcher } from "../../src/input/command-dispatcher";
import type { LimbController } from "../../src/input/limb-controller";
import { type CommandMessage, RemoteCommands } from "../../src/input/remote-commands";
import { VelocityInputs } from "../../src/input/velocity-input";
import { createStandingPuppet } from "../stage/puppet/figures";
import { createLimbController, FakePuppeteer } from "./fake-puppeteer";
import { recordPageActions } from "./page-actions";

const LEFT_HAND = 0;

let sent: CommandMessage[];
let done: string[];
let isReady: boolean;
let isLimbSelected: boolean;
let commands: RemoteCommands;

beforeEach(() => {
  [sent, done, isReady, isLimbSelected] = [[], [], true, false];
  commands = new RemoteCommands({
    actions: recordPageActions(done),
    isReady: () => isReady,
    isLimbSelected: () => isLimbSelected,
    send: (message) => sent.push(message),
  });
});

test("the page runs its own actions at once, and the limbs' realm gets the presses that may concern a limb", () => {
  expect(commands.press("Space", ["play"], 1, 5)).toBe(true);
  expect([done, sent]).toEqual([["play"], []]);
  expect(commands.press("Digit1", ["take_right_hand", "picture"], 1, 6)).toBe(true);
  commands.release("Digit1", 7);
  commands.release("Digit1", 8);
  expect(done).toEqual(["play", "picture"]);
  expect(sent).toEqual([
    { type: "press", control: "Digit1", commands: ["take_right_hand"], strength: 1, now: 6 },
    { type: "release", control: "Digit1", now: 7 },
  ]);
});

test("a held control is sent again only if its strength changes, and seeks when repeated", () => {
  commands.press("pad", ["left_leg+"], 0.5, 0);
  commands.press("pad", ["left_leg+"], 0.5, 16);
  commands.press("pad", ["left_leg+"], 0.75, 32);
  expect(sent.map((message) => ("strength" in message ? message.strength : null))).toEqual([0.5, 0.75]);
  commands.press("arrow", ["forward"], 1, 40);
  expect(commands.repeat("arrow")).toBe(true);
  expect(done).toEqual(["forward", "forward"]);
});

test("controls without a command that applies are left to the browser", () => {
  expect(commands.press("KeyZ", [], 1, 0)).toBe(false);
  expect([commands.isDown("KeyZ"), sent]).toEqual([false, []]);
  expect(commands.press("ArrowUp", ["held_y+"], 1, 0)).toBe(false);
  expect(commands.repeat("ArrowUp")).toBe(false);
  isLimbSelected = true;
  expect(commands.repeat("ArrowUp")).toBe(true);
});

test("without a stage, no limb is selected", () => {
  isReady = false;
  commands.press("ArrowRight", ["held_x+", "forward"], 1, 0);
  isReady = true;
  commands.repeat("ArrowRight");
  expect([done, sent]).toEqual([["forward", "forward"], []]);
});

test("matching controls are released together, without a message if there are none", () => {
  commands.press("KeyA", ["take_left_leg"], 1, 0);
  commands.press("pad:0", ["take_left_hand"], 1, 0);
  sent.length = 0;
  commands.releaseAll((control) => control.startsWith("pad"));
  commands.releaseAll((control) => control.startsWith("pad"));
  expect(sent).toEqual([{ type: "release all", controls: ["pad:0"] }]);
  expect(commands.isDown("KeyA")).toBe(true);
});

/** The other realm, which handles messages later than the page sends them. */
class LimbRealm {
  readonly session = new FakePuppeteer();
  readonly #limbController: LimbController = createLimbController(createStandingPuppet(), this.session);
  readonly velocity = new VelocityInputs(this.#limbController, {
    claim: (limb) => this.#limbController.claim(limb, "velocity"),
    isFree: (limb) => this.#limbController.source(limb) === null,
  });
  readonly #dispatcher = new CommandDispatcher(this.#limbController, this.velocity, recordPageActions(done));

  /** Handle all messages sent so far. */
  handle(): void {
    for (const message of sent.splice(0)) {
      if (message.type === "press")
        this.#dispatcher.press(message.control, message.commands, message.strength, message.now);
      else if (message.type === "repeat") this.#dispatcher.repeat(message.control);
      else if (message.type === "release") this.#dispatcher.release(message.control, message.now);
      else this.#dispatcher.releaseAll((control) => message.controls.includes(control));
    }
  }
}

test("keys that follow a claim or a release at once have the effect that they will have", () => {
  const realm = new LimbRealm();
  // The page does not know of the claim before the end of all four keys.
  commands.press("Digit2", ["take_left_hand"], 1, 0);
  commands.release("Digit2", 50);
  commands.press("ArrowRight", ["held_x+", "forward"], 1, 60);
  commands.press("KeyW", ["held_y+"], 1, 70);
  realm.handle();
  realm.velocity.update(80);
  expect(done).toEqual([]);
  expect(realm.session.takeCalls().at(-1)).toEqual(["velocity", LEFT_HAND, 0.71875, 0.71875, 0]);

  // Nor of the release.
  isLimbSelected = true;
  commands.release("ArrowRight", 90);
  commands.release("KeyW", 90);
  commands.press("Digit2", ["take_left_hand"], 1, 100);
  commands.release("Digit2", 150);
  commands.press("ArrowRight", ["held_x+", "forward"], 1, 160);
  commands.repeat("ArrowRight");
  realm.handle();
  expect(done).toEqual(["forward", "forward"]);
});
