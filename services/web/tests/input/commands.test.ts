import { beforeEach, describe, expect, test } from "vitest";
import { Chosen } from "../../src/input/chosen";
import { Commands } from "../../src/input/commands";
import type { Hands } from "../../src/input/hands";
import { VelocityInputs } from "../../src/input/velocity";
import { standingPuppet } from "../stage/standard-figure";
import { deeds } from "./deeds";
import { handsBefore, Session } from "./session";

const LEFT_HAND = 0;

let hands: Hands;
let velocity: VelocityInputs;
let commands: Commands;
let session: Session;
let told: string[];
let chosen: Chosen;

beforeEach(() => {
  session = new Session();
  hands = handsBefore(standingPuppet(), session);
  told = [];
  chosen = new Chosen();
  velocity = new VelocityInputs(hands, { take: (limb) => hands.take(limb, "velocity"), free: (limb) => hands.source(limb) === null, chosen });
  commands = new Commands(hands, velocity, deeds(told));
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
    chosen.choose(1);
    commands.press("Digit2", ["take_left_hand"], 1, 0);
    chosen.choose(0);
    expect(hands.source(4 + LEFT_HAND)).toBe("velocity");
    commands.release("Digit2", 500);
    expect(hands.any).toBe(false);
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
    hands.take(LEFT_HAND, "pointer");
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
  expect(session.take()).toEqual([["claim", 0], ["velocity", 0, 0.5, 0, 0], ["claim", 3], ["velocity", 3, -1, 0, 0]]);
  commands.forget((control) => control.startsWith("Key"));
  velocity.update(32);
  expect(session.take()).toEqual([["velocity", 0, 0.5, 0, 0], ["velocity", 3, 0, 0, 0]]);
  expect([commands.isDown("KeyU"), commands.isDown("axis:0+")]).toEqual([false, true]);
  commands.release("axis:0+", 48);
  velocity.update(48);
  expect(session.take()[0]).toEqual(["velocity", 0, 0, 0, 0]);
});
