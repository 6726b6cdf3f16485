import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { CommandDispatcher } from "../../src/input/command-dispatcher";
import type { LimbController } from "../../src/input/limb-controller";
import { bind, DEFAULT_MAPPING, type Mapping } from "../../src/input/mapping";
import { controlOfEvent, listenToMouse } from "../../src/input/mouse";
import { VelocityInputs } from "../../src/input/velocity-input";
import { createStandingPuppet } from "../stage/puppet/figures";
import { createLimbController, FakePuppeteer } from "./fake-puppeteer";
import { recordPageActions } from "./page-actions";

const LEFT_HAND = 0;

let canvas: EventTarget;
let window: EventTarget;
let limbController: LimbController;
let velocity: VelocityInputs;
let session: FakePuppeteer;
let actions: string[];
let mapping: Mapping;

beforeEach(() => {
  vi.useFakeTimers();
  [canvas, window, session, actions, mapping] = [
    new EventTarget(),
    new EventTarget(),
    new FakePuppeteer(),
    [],
    DEFAULT_MAPPING,
  ];
  limbController = createLimbController(createStandingPuppet(), session);
  velocity = new VelocityInputs(limbController, {
    claim: (limb) => limbController.claim(limb, "velocity"),
    isFree: (limb) => limbController.source(limb) === null,
  });
  listenToMouse(
    canvas as HTMLElement,
    window,
    new CommandDispatcher(limbController, velocity, recordPageActions(actions)),
    () => mapping,
  );
});
afterEach(() => vi.useRealTimers());

function send(type: string, properties: { button?: number; deltaY?: number }): boolean {
  const event = Object.assign(new Event(type, { cancelable: true }), { button: 0, ...properties });
  (type === "mouseup" ? window : canvas).dispatchEvent(event);
  return event.defaultPrevented;
}

test("a notch of the wheel moves the held limb, and scrolls without one", () => {
  expect(send("wheel", { deltaY: 100 })).toBe(false);
  velocity.hold(LEFT_HAND);
  session.takeCalls();
  expect(send("wheel", { deltaY: 100 })).toBe(true);
  velocity.update(0);
  vi.advanceTimersByTime(60);
  send("wheel", { deltaY: 100 });
  vi.advanceTimersByTime(100);
  velocity.update(16);
  expect(session.takeCalls()).toEqual([
    ["velocity", LEFT_HAND, 0, 0, 1],
    ["velocity", LEFT_HAND, 0, 0, 1],
  ]);
  send("wheel", { deltaY: -100 });
  velocity.update(32);
  vi.advanceTimersByTime(120);
  velocity.update(48);
  expect(session.takeCalls()).toEqual([
    ["velocity", LEFT_HAND, 0, 0, -1],
    ["velocity", LEFT_HAND, 0, 0, 0],
  ]);
});

test("the wheel moves the depth of a limb that a pointer pulls", () => {
  limbController.claim(LEFT_HAND, "pointer");
  send("wheel", { deltaY: 100 });
  velocity.update(0);
  expect([velocity.depthInput(LEFT_HAND), velocity.depthInput(1), limbController.source(LEFT_HAND)]).toEqual([
    1,
    0,
    "pointer",
  ]);
  vi.advanceTimersByTime(120);
  velocity.update(16);
  expect(velocity.depthInput(LEFT_HAND)).toBe(0);
});

test("additional buttons run their bindings, the primary one does not", () => {
  mapping = bind(bind(DEFAULT_MAPPING, "mouse:2", "keep"), "mouse:1", "left_leg+");
  expect([
    send("mousedown", { button: 2 }),
    send("mousedown", { button: 0 }),
    send("mousedown", { button: 3 }),
  ]).toEqual([true, false, false]);
  expect([actions, send("contextmenu", { button: 2 })]).toEqual([["keep"], true]);
  send("mousedown", { button: 1 });
  velocity.update(0);
  send("mouseup", { button: 1 });
  velocity.update(16);
  expect(session.takeCalls()).toEqual([
    ["claim", 2],
    ["velocity", 2, 1, 0, 0],
    ["velocity", 2, 0, 0, 0],
  ]);
  expect(controlOfEvent({ type: "wheel", deltaY: 0, button: 0 } as unknown as MouseEvent)).toBe(null);
});
