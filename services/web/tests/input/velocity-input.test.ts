import { beforeEach, describe, expect, test } from "vitest";
import type { LimbController } from "../../src/input/limb-controller";
import { PerformerSelection } from "../../src/input/performer-selection";
import { VelocityInputs } from "../../src/input/velocity-input";
import { createStandingPuppet } from "../stage/puppet/figures";
import { createLimbController, FakePuppeteer } from "./fake-puppeteer";

const [LEFT_HAND, RIGHT_HAND, LEFT_LEG] = [0, 1, 2];

let session: FakePuppeteer;
let limbController: LimbController;
let velocity: VelocityInputs;
let claims: number[];
let others: Set<number>;
let selection: PerformerSelection;

beforeEach(() => {
  session = new FakePuppeteer();
  limbController = createLimbController(createStandingPuppet(), session);
  claims = [];
  others = new Set();
  selection = new PerformerSelection();
  selection.count = 2;
  velocity = new VelocityInputs(limbController, {
    claim: (limb) => {
      claims.push(limb);
      return !others.has(limb) && limbController.claim(limb, "velocity");
    },
    isFree: (limb) => !others.has(limb) && limbController.source(limb) === null,
    selection,
  });
});

test("the first press claims and moves a limb, and rest releases it later", () => {
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
  expect(limbController.source(LEFT_HAND)).toBe("velocity");
  velocity.update(717);
  expect(limbController.source(LEFT_HAND)).toBe(null);
  expect(session.calls.at(-1)).toEqual(["release", LEFT_HAND]);
  velocity.set("KeyU", "left_hand_x+", 1);
  velocity.update(733);
  expect(limbController.source(LEFT_HAND)).toBe("velocity");
  expect(claims).toEqual([LEFT_HAND, LEFT_HAND]);
});

test("opposite inputs cancel, and several limbs move at once", () => {
  velocity.set("KeyU", "left_hand_y+", 1);
  velocity.set("button:3", "left_hand_y-", 1);
  velocity.set("KeyI", "left_leg+", 1);
  velocity.update(0);
  velocity.update(2000);
  expect(session.calls.slice(-2)).toEqual([
    ["velocity", LEFT_HAND, 0, 0, 0],
    ["velocity", LEFT_LEG, 1, 0, 0],
  ]);
  expect([LEFT_HAND, RIGHT_HAND, LEFT_LEG].map((limb) => limbController.source(limb))).toEqual([
    "velocity",
    null,
    "velocity",
  ]);
});

describe("the selected limb", () => {
  test("is the one held last, and takes the inputs of the selection", () => {
    expect(velocity.selectedLimb).toBe(null);
    velocity.set("KeyW", "held_y+", 1);
    velocity.update(0);
    expect(session.calls).toEqual([]);
    let seen: number | null = null;
    limbController.onChange = () => (seen = velocity.selectedLimb);
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

  test("is none that a push claimed, unless it is held", () => {
    velocity.set("axis:0+", "left_hand_x+", 0.5);
    velocity.update(0);
    expect([velocity.selectedLimb, velocity.holds(LEFT_HAND)]).toEqual([null, false]);
    velocity.hold(LEFT_HAND);
    expect([velocity.selectedLimb, velocity.holds(LEFT_HAND)]).toEqual([LEFT_HAND, true]);
    velocity.set("axis:0+", "left_hand_x+", 0);
    velocity.update(5000);
    expect(limbController.source(LEFT_HAND)).toBe("velocity");
  });
});

describe("a limb that another puppeteer holds", () => {
  test("is claimed once per push, and again when it becomes free", () => {
    others.add(LEFT_HAND);
    velocity.set("axis:0+", "left_hand_x+", 1);
    for (let now = 0; now <= 3200; now += 16) velocity.update(now);
    expect([claims, session.calls]).toEqual([[LEFT_HAND], []]);
    others.clear();
    velocity.update(3216);
    expect([claims, limbController.source(LEFT_HAND)]).toEqual([[LEFT_HAND, LEFT_HAND], "velocity"]);
  });

  test("lost or released during a push is not claimed again before rest", () => {
    velocity.set("axis:0+", "left_hand_x+", 1);
    velocity.update(0);
    limbController.onRefused(LEFT_HAND);
    for (let now = 16; now <= 3200; now += 16) velocity.update(now);
    expect(claims).toEqual([LEFT_HAND]);
    velocity.set("axis:0+", "left_hand_x+", 0);
    velocity.update(3216);
    velocity.set("axis:0+", "left_hand_x+", 1);
    velocity.update(3232);
    expect(limbController.source(LEFT_HAND)).toBe("velocity");
    velocity.release(LEFT_HAND);
    for (let now = 3248; now <= 5000; now += 16) velocity.update(now);
    expect(limbController.source(LEFT_HAND)).toBe(null);
  });
});

test("a limb that a pointer holds is left alone", () => {
  limbController.claim(LEFT_HAND, "pointer");
  session.takeCalls();
  velocity.set("axis:0+", "left_hand_x+", 1);
  velocity.update(0);
  velocity.release(LEFT_HAND);
  expect([limbController.source(LEFT_HAND), claims, session.calls]).toEqual(["pointer", [], []]);
});

describe("several performers", () => {
  const SECOND = 4;

  test("inputs move the selected one's limbs and follow the selection", () => {
    selection.select(1);
    velocity.set("stick", "left_hand_x+", 1);
    velocity.update(0);
    expect(claims).toEqual([SECOND + LEFT_HAND]);
    selection.select(0);
    velocity.update(16);
    expect(claims).toEqual([SECOND + LEFT_HAND, LEFT_HAND]);
    velocity.update(800);
    expect([limbController.source(SECOND + LEFT_HAND), limbController.source(LEFT_HAND)]).toEqual([null, "velocity"]);
  });

  test("held limbs stay held, and selection keys move the selected one's", () => {
    velocity.hold(LEFT_HAND);
    selection.select(1);
    expect(velocity.selectedLimb).toBe(null);
    velocity.hold(SECOND + RIGHT_HAND);
    expect([velocity.selectedLimb, velocity.holds(LEFT_HAND)]).toEqual([SECOND + RIGHT_HAND, true]);
    selection.select(0);
    expect(velocity.selectedLimb).toBe(LEFT_HAND);
  });

  test("all limbs are released together", () => {
    expect(velocity.releaseAll()).toBe(false);
    velocity.hold(LEFT_HAND);
    velocity.hold(SECOND + LEFT_LEG);
    selection.select(1);
    expect(velocity.releaseAll()).toBe(true);
    expect(limbController.isHoldingAny).toBe(false);
    limbController.claim(RIGHT_HAND, "pointer");
    expect([velocity.releaseAll(), limbController.source(RIGHT_HAND)]).toEqual([true, "pointer"]);
  });
});
