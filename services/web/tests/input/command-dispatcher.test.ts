import { beforeEach, describe, expect, test } from "vitest";
import { CommandDispatcher } from "../../src/input/command-dispatcher";
import type { LimbController } from "../../src/input/limb-controller";
import { PerformerSelection } from "../../src/input/performer-selection";
import { VelocityInputs } from "../../src/input/velocity-input";
import { createStandingPuppet } from "../stage/puppet/figures";
import { createLimbController, FakePuppeteer } from "./fake-puppeteer";
import { recordPageActions } from "./page-actions";

const LEFT_HAND = 0;

let hands: LimbController;
let velocity: VelocityInputs;
let commands: CommandDispatcher;
let session: FakePuppeteer;
let told: string[];
let chosen: PerformerSelection;

beforeEach(() => {
  session = new FakePuppeteer();
  hands = createLimbController(createStandingPuppet(), session);
  told = [];
  chosen = new PerformerSelection();
  velocity = new VelocityInputs(hands, {
    claim: (limb) => hands.claim(limb, "velocity"),
    isFree: (limb) => hands.source(limb) === null,
    selection: chosen,
  });
  commands = new CommandDispatcher(hands, velocity, recordPageActions(told));
});

describe("a control that takes a limb", () => {
  test("tapped holds it, and the next tap lets it go", () => {
    commands.press("Digit2", ["take_left_hand"], 1, 0);
    commands.release("Digit2", 100);
    expect(velocity.holds(LEFT_HAND)).toBe(true);
    commands.press("Digit2", ["take_left_hand"], 1, 1000);
    expect(velocity.holds(LEFT_HAND)).toBe(true);
    commands.release("Digit2", 1100);
    expect(hands.source(LEFT_HAND)).toBe(null);
  });

  test("takes it of the chosen performer, and lets go what it took though another is chosen meanwhile", () => {
    chosen.count = 2;
    chosen.select(1);
    commands.press("Digit2", ["take_left_hand"], 1, 0);
    chosen.select(0);
    expect(hands.source(4 + LEFT_HAND)).toBe("velocity");
    commands.release("Digit2", 500);
    expect(hands.isHoldingAny).toBe(false);
  });

  test("held long holds it for as long as it lasts", () => {
    commands.press("Digit2", ["take_left_hand"], 1, 0);
    commands.release("Digit2", 401);
    expect(hands.source(LEFT_HAND)).toBe(null);
  });

  test("tapped makes one that a push took stay", () => {
    commands.press("axis:0+", ["left_hand_x+"], 1, 0);
    velocity.update(0);
    commands.press("Digit2", ["take_left_hand"], 1, 10);
    commands.release("Digit2", 100);
    commands.release("axis:0+", 200);
    velocity.update(5000);
    expect(velocity.holds(LEFT_HAND)).toBe(true);
  });

  test("leaves to the pointer what it holds", () => {
    hands.claim(LEFT_HAND, "pointer");
    commands.press("Digit2", ["take_left_hand"], 1, 0);
    commands.release("Digit2", 1000);
    expect(hands.source(LEFT_HAND)).toBe("pointer");
  });
});

test("an action is done once a press, and seeking with every repeat", () => {
  commands.press("Space", ["play"], 1, 0);
  commands.press("Space", ["play"], 1, 16);
  commands.repeat("Space");
  expect(told).toEqual(["play"]);
  commands.press("ArrowRight", ["forward"], 1, 0);
  commands.repeat("ArrowRight");
  commands.repeat("ArrowRight");
  commands.release("ArrowRight", 100);
  commands.repeat("ArrowRight");
  expect(told).toEqual(["play", "forward", "forward", "forward"]);
});

test("inputs go as strongly as they are pressed, until they come up or are forgotten", () => {
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
