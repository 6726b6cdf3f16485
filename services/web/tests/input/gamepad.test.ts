import { beforeEach, expect, test } from "vitest";
import { CommandDispatcher } from "../../src/input/command-dispatcher";
import { createGamepadInput, type GamepadInput } from "../../src/input/gamepad";
import type { LimbController } from "../../src/input/limb-controller";
import { bind, DEFAULT_MAPPING, type Mapping } from "../../src/input/mapping";
import { VelocityInputs } from "../../src/input/velocity-input";
import { createStandingPuppet } from "../stage/puppet/figures";
import { createLimbController, FakePuppeteer } from "./fake-puppeteer";
import { createGamepad } from "./gamepads";
import { recordPageActions } from "./page-actions";

const LEFT_HAND = 0;
const [A, LEFT, RIGHT] = [0, 14, 15];

let session: FakePuppeteer;
let limbController: LimbController;
let velocity: VelocityInputs;
let pads: (Gamepad | null)[];
let input: GamepadInput;
let actions: string[];
let mapping: Mapping;

beforeEach(() => {
  session = new FakePuppeteer();
  limbController = createLimbController(createStandingPuppet(), session);
  pads = [];
  actions = [];
  mapping = DEFAULT_MAPPING;
  velocity = new VelocityInputs(limbController, {
    claim: (limb) => limbController.claim(limb, "velocity"),
    isFree: (limb) => limbController.source(limb) === null,
  });
  input = createGamepadInput(
    new CommandDispatcher(limbController, velocity, recordPageActions(actions)),
    () => mapping,
    () => pads,
  );
});

function frame(now: number, acting = true): void {
  input.update(now, acting);
  velocity.update(now);
}

test("a pushed stick claims and moves its hand, and stops at once at rest", () => {
  pads = [createGamepad([1, 0, 0, 0])];
  frame(0);
  expect(session.takeCalls()).toEqual([
    ["claim", LEFT_HAND],
    ["velocity", LEFT_HAND, 1, 0, 0],
  ]);
  frame(16);
  pads = [createGamepad([0.05, 0, 0, 0])];
  frame(32);
  expect(session.calls.at(-1)).toEqual(["velocity", LEFT_HAND, 0, 0, 0]);
});

test("a trembling stick is smoothed by the chosen amount", () => {
  const shake = (stickSmoothing: number) => {
    mapping = { ...DEFAULT_MAPPING, stickSmoothing };
    const strengths: number[] = [];
    for (let i = 0; i < 200; i++) {
      pads = [createGamepad([0.6 + 0.1 * (i % 2), 0, 0, 0])];
      frame(i * 16);
      strengths.push(session.takeCalls().at(-1)?.[2] as number);
    }
    pads = [createGamepad()];
    frame(200 * 16);
    const steady = strengths.slice(100);
    return Math.max(...steady) - Math.min(...steady);
  };
  expect(shake(0)).toBeGreaterThan(0.1);
  expect(shake(1)).toBeLessThan(0.04);
});

test("a disconnected gamepad stops its limbs and releases them", () => {
  pads = [createGamepad([1, 0, -1, 0])];
  frame(0);
  expect([limbController.source(0), limbController.source(1)]).toEqual(["velocity", "velocity"]);
  pads = [null];
  frame(16);
  expect(session.calls.slice(-2)).toEqual([
    ["velocity", 0, 0, 0, 0],
    ["velocity", 1, 0, 0, 0],
  ]);
  frame(1000);
  expect([limbController.source(0), limbController.source(1), input.pad]).toEqual([null, null, null]);
});

test("the first connected standard gamepad is read", () => {
  const disconnected = { ...createGamepad([1, 0, 0, 0]), connected: false } as Gamepad;
  const standard = createGamepad();
  pads = [null, disconnected, createGamepad([1, 0, 0, 0], { [A]: 1 }, ""), standard, createGamepad([1, 0, 0, 0])];
  frame(0);
  expect(input.pad).toBe(standard);
  expect([actions, session.calls]).toEqual([[], []]);
});

test("a held button plays and seeks once", () => {
  pads = [createGamepad([0, 0, 0, 0], { [A]: 1, [LEFT]: 1 })];
  frame(0);
  frame(16);
  expect(actions).toEqual(["play", "back"]);
  pads = [createGamepad()];
  frame(32);
  pads = [createGamepad([0, 0, 0, 0], { [RIGHT]: 1 })];
  frame(48);
  expect(actions).toEqual(["play", "back", "forward"]);
});

test("a button does what the mapping says, and nothing while disabled", () => {
  mapping = bind(DEFAULT_MAPPING, "button:1", "right_leg+");
  pads = [createGamepad([0, 0, 0, 0], { 1: 1 })];
  frame(0, false);
  expect([session.calls, input.pad]).toEqual([[], pads[0]]);
  frame(16);
  expect(session.takeCalls()).toEqual([
    ["claim", 3],
    ["velocity", 3, 1, 0, 0],
  ]);
});

test("the shoulder button moves a pushed stick from the hand to the leg", () => {
  pads = [createGamepad([0, -1, 0, 0])];
  frame(0);
  session.takeCalls();
  pads = [createGamepad([0, -1, 0, 0], { 4: 1 })];
  frame(16);
  expect(session.takeCalls()).toEqual([
    ["velocity", LEFT_HAND, 0, 0, 0],
    ["claim", 2],
    ["velocity", 2, 1, 0, 0],
  ]);
});
