import { beforeEach, describe, expect, test } from "vitest";
import type { LimbController } from "../../src/input/limb-controller";
import { PerformerSelection } from "../../src/input/performer-selection";
import { VelocityInputs } from "../../src/input/velocity-input";
import { createStandingPuppet } from "../stage/puppet/figures";
import { createLimbController, FakePuppeteer } from "./fake-puppeteer";

const [LEFT_HAND, RIGHT_HAND, LEFT_LEG] = [0, 1, 2];

let session: FakePuppeteer;
let hands: LimbController;
let velocity: VelocityInputs;
let told: number[];
let others: Set<number>;
let chosen: PerformerSelection;

beforeEach(() => {
  session = new FakePuppeteer();
  hands = createLimbController(createStandingPuppet(), session);
  told = [];
  others = new Set();
  chosen = new PerformerSelection();
  chosen.count = 2;
  velocity = new VelocityInputs(hands, {
    claim: (limb) => {
      told.push(limb);
      return !others.has(limb) && hands.claim(limb, "velocity");
    },
    isFree: (limb) => !others.has(limb) && hands.source(limb) === null,
    selection: chosen,
  });
});

test("the first press takes its limb and moves it; all at rest, it stops at once and is given back a while later", () => {
  velocity.set("KeyU", "left_hand_x+", 1);
  velocity.update(0);
  expect(session.takeCalls()).toEqual([
    ["claim", LEFT_HAND],
    ["velocity", LEFT_HAND, 1, 0, 0],
  ]);
  velocity.update(16);
  velocity.set("KeyU", "left_hand_x+", 0);
  velocity.update(100);
  expect(session.calls.at(-1)).toEqual(["velocity", LEFT_HAND, 0, 0, 0]);
  velocity.update(716);
  expect(hands.source(LEFT_HAND)).toBe("velocity");
  velocity.update(717);
  expect(hands.source(LEFT_HAND)).toBe(null);
  expect(session.calls.at(-1)).toEqual(["release", LEFT_HAND]);
  velocity.set("KeyU", "left_hand_x+", 1);
  velocity.update(733);
  expect(hands.source(LEFT_HAND)).toBe("velocity");
  expect(told).toEqual([LEFT_HAND, LEFT_HAND]);
});

test("opposite ones cancel and keep the limb, several limbs go at once, a leg goes up", () => {
  velocity.set("KeyU", "left_hand_y+", 1);
  velocity.set("button:3", "left_hand_y-", 1);
  velocity.set("KeyI", "left_leg+", 1);
  velocity.update(0);
  velocity.update(2000);
  expect(session.calls.slice(-2)).toEqual([
    ["velocity", LEFT_HAND, 0, 0, 0],
    ["velocity", LEFT_LEG, 1, 0, 0],
  ]);
  expect([LEFT_HAND, RIGHT_HAND, LEFT_LEG].map((limb) => hands.source(limb))).toEqual(["velocity", null, "velocity"]);
});

describe("the held string", () => {
  test("is the limb taken last; inputs of it move that and nothing else", () => {
    expect(velocity.selectedLimb).toBe(null);
    velocity.set("KeyW", "held_y+", 1);
    velocity.update(0);
    expect(session.calls).toEqual([]);
    let seen: number | null = null;
    hands.onChange = () => (seen = velocity.selectedLimb);
    velocity.hold(LEFT_HAND);
    velocity.hold(RIGHT_HAND);
    expect([velocity.selectedLimb, seen]).toEqual([RIGHT_HAND, RIGHT_HAND]);
    velocity.hold(LEFT_HAND);
    velocity.hold(RIGHT_HAND);
    expect(seen).toBe(RIGHT_HAND);
    session.takeCalls();
    velocity.update(16);
    expect(session.takeCalls()).toEqual([
      ["velocity", LEFT_HAND, 0, 0, 0],
      ["velocity", RIGHT_HAND, 0, 1, 0],
    ]);
    velocity.release(RIGHT_HAND);
    expect(velocity.selectedLimb).toBe(LEFT_HAND);
  });

  test("is not one that a push alone took, until it is held; what is held is kept at rest", () => {
    velocity.set("axis:0+", "left_hand_x+", 0.5);
    velocity.update(0);
    expect([velocity.selectedLimb, velocity.holds(LEFT_HAND)]).toEqual([null, false]);
    velocity.hold(LEFT_HAND);
    expect([velocity.selectedLimb, velocity.holds(LEFT_HAND)]).toEqual([LEFT_HAND, true]);
    velocity.set("axis:0+", "left_hand_x+", 0);
    velocity.update(5000);
    expect(hands.source(LEFT_HAND)).toBe("velocity");
  });
});

describe("a limb that another holds", () => {
  test("is reached for once with every push, and taken when it comes free under one", () => {
    others.add(LEFT_HAND);
    velocity.set("axis:0+", "left_hand_x+", 1);
    for (let now = 0; now <= 3200; now += 16) velocity.update(now);
    expect([told, session.calls]).toEqual([[LEFT_HAND], []]);
    others.clear();
    velocity.update(3216);
    expect([told, hands.source(LEFT_HAND)]).toEqual([[LEFT_HAND, LEFT_HAND], "velocity"]);
  });

  test("taken away, or let go, under a push is not taken again before a rest", () => {
    velocity.set("axis:0+", "left_hand_x+", 1);
    velocity.update(0);
    hands.onRefused(LEFT_HAND);
    for (let now = 16; now <= 3200; now += 16) velocity.update(now);
    expect(told).toEqual([LEFT_HAND]);
    velocity.set("axis:0+", "left_hand_x+", 0);
    velocity.update(3216);
    velocity.set("axis:0+", "left_hand_x+", 1);
    velocity.update(3232);
    expect(hands.source(LEFT_HAND)).toBe("velocity");
    velocity.release(LEFT_HAND);
    for (let now = 3248; now <= 5000; now += 16) velocity.update(now);
    expect(hands.source(LEFT_HAND)).toBe(null);
  });
});

test("leaves alone what a pointer holds", () => {
  hands.claim(LEFT_HAND, "pointer");
  session.takeCalls();
  velocity.set("axis:0+", "left_hand_x+", 1);
  velocity.update(0);
  velocity.release(LEFT_HAND);
  expect([hands.source(LEFT_HAND), told, session.calls]).toEqual(["pointer", [], []]);
});

describe("of several performers", () => {
  const SECOND = 4;

  test("inputs move the limbs of the chosen one, and go over with the choice", () => {
    chosen.select(1);
    velocity.set("stick", "left_hand_x+", 1);
    velocity.update(0);
    expect(told).toEqual([SECOND + LEFT_HAND]);
    chosen.select(0);
    velocity.update(16);
    expect(told).toEqual([SECOND + LEFT_HAND, LEFT_HAND]);
    velocity.update(800);
    expect([hands.source(SECOND + LEFT_HAND), hands.source(LEFT_HAND)]).toEqual([null, "velocity"]);
  });

  test("what is held stays held, and only the chosen one's is moved by the keys of the held string", () => {
    velocity.hold(LEFT_HAND);
    chosen.select(1);
    expect(velocity.selectedLimb).toBe(null);
    velocity.hold(SECOND + RIGHT_HAND);
    expect([velocity.selectedLimb, velocity.holds(LEFT_HAND)]).toEqual([SECOND + RIGHT_HAND, true]);
    chosen.select(0);
    expect(velocity.selectedLimb).toBe(LEFT_HAND);
  });

  test("all are let go together", () => {
    expect(velocity.releaseAll()).toBe(false);
    velocity.hold(LEFT_HAND);
    velocity.hold(SECOND + LEFT_LEG);
    chosen.select(1);
    expect(velocity.releaseAll()).toBe(true);
    expect(hands.isHoldingAny).toBe(false);
    hands.claim(RIGHT_HAND, "pointer");
    expect([velocity.releaseAll(), hands.source(RIGHT_HAND)]).toEqual([true, "pointer"]);
  });
});
