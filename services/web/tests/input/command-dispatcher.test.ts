import { beforeEach, describe, expect, test } from "vitest";
import { CommandDispatcher } from "../../src/input/command-dispatcher";
import type { LimbController } from "../../src/input/limb-controller";
import { PerformerSelection } from "../../src/input/performer-selection";
import { VelocityInputs } from "../../src/input/velocity-input";
import { createStandingPuppet } from "../stage/puppet/figures";
import { createLimbController, FakePuppeteer } from "./fake-puppeteer";
import { recordPageActions } from "./page-actions";

const LEFT_HAND = 0;

let limbController: LimbController;
let velocity: VelocityInputs;
let commands: CommandDispatcher;
let session: FakePuppeteer;
let actions: string[];
let selection: PerformerSelection;

beforeEach(() => {
  session = new FakePuppeteer();
  limbController = createLimbController(createStandingPuppet(), session);
  actions = [];
  selection = new PerformerSelection();
  velocity = new VelocityInputs(limbController, {
    claim: (limb) => limbController.claim(limb, "velocity"),
    isFree: (limb) => limbController.source(limb) === null,
    selection,
  });
  commands = new CommandDispatcher(limbController, velocity, recordPageActions(actions));
});

describe("a control that claims a limb", () => {
  test("holds it after a tap and releases it with the next", () => {
    commands.press("Digit2", ["take_left_hand"], 1, 0);
    commands.release("Digit2", 100);
    expect(velocity.holds(LEFT_HAND)).toBe(true);
    commands.press("Digit2", ["take_left_hand"], 1, 1000);
    expect(velocity.holds(LEFT_HAND)).toBe(true);
    commands.release("Digit2", 1100);
    expect(limbController.source(LEFT_HAND)).toBe(null);
  });

  test("claims for the selected performer and releases the limb it claimed", () => {
    selection.count = 2;
    selection.select(1);
    commands.press("Digit2", ["take_left_hand"], 1, 0);
    selection.select(0);
    expect(limbController.source(4 + LEFT_HAND)).toBe("velocity");
    commands.release("Digit2", 500);
    expect(limbController.isHoldingAny).toBe(false);
  });

  test("held long releases the limb with the control", () => {
    commands.press("Digit2", ["take_left_hand"], 1, 0);
    commands.release("Digit2", 401);
    expect(limbController.source(LEFT_HAND)).toBe(null);
  });

  test("tapped keeps a limb that a push claimed", () => {
    commands.press("axis:0+", ["left_hand_x+"], 1, 0);
    velocity.update(0);
    commands.press("Digit2", ["take_left_hand"], 1, 10);
    commands.release("Digit2", 100);
    commands.release("axis:0+", 200);
    velocity.update(5000);
    expect(velocity.holds(LEFT_HAND)).toBe(true);
  });

  test("does not release a limb that a pointer holds", () => {
    limbController.claim(LEFT_HAND, "pointer");
    commands.press("Digit2", ["take_left_hand"], 1, 0);
    commands.release("Digit2", 1000);
    expect(limbController.source(LEFT_HAND)).toBe("pointer");
  });
});

test("an action runs once per press, and seeking with every repeat", () => {
  commands.press("Space", ["play"], 1, 0);
  commands.press("Space", ["play"], 1, 16);
  commands.repeat("Space");
  expect(actions).toEqual(["play"]);
  commands.press("ArrowRight", ["forward"], 1, 0);
  commands.repeat("ArrowRight");
  commands.repeat("ArrowRight");
  commands.release("ArrowRight", 100);
  commands.repeat("ArrowRight");
  expect(actions).toEqual(["play", "forward", "forward", "forward"]);
});

test("inputs have the strength of the press until released or cleared", () => {
  commands.press("axis:0+", ["left_hand_x+"], 0.25, 0);
  commands.press("axis:0+", ["left_hand_x+"], 0.5, 16);
  commands.press("KeyU", ["right_leg-"], 1, 16);
  velocity.update(16);
  expect(session.takeCalls()).toEqual([
    ["claim", 0],
    ["velocity", 0, 0.5, 0, 0],
    ["claim", 3],
    ["velocity", 3, -1, 0, 0],
  ]);
  commands.releaseAll((control) => control.startsWith("Key"));
  velocity.update(32);
  expect(session.takeCalls()).toEqual([
    ["velocity", 0, 0.5, 0, 0],
    ["velocity", 3, 0, 0, 0],
  ]);
  expect([commands.isDown("KeyU"), commands.isDown("axis:0+")]).toEqual([false, true]);
  commands.release("axis:0+", 48);
  velocity.update(48);
  expect(session.takeCalls()[0]).toEqual(["velocity", 0, 0, 0, 0]);
});
