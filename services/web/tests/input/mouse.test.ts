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
let hands: LimbController;
let velocity: VelocityInputs;
let session: FakePuppeteer;
let told: string[];
let mapping: Mapping;

beforeEach(() => {
  vi.useFakeTimers();
  [canvas, window, session, told, mapping] = [
    new EventTarget(),
    new EventTarget(),
    new FakePuppeteer(),
    [],
    DEFAULT_MAPPING,
  ];
  hands = createLimbController(createStandingPuppet(), session);
  velocity = new VelocityInputs(hands, {
    claim: (limb) => hands.claim(limb, "velocity"),
    isFree: (limb) => hands.source(limb) === null,
  });
  listenToMouse(
    canvas as HTMLElement,
    window,
    new CommandDispatcher(hands, velocity, recordPageActions(told)),
    () => mapping,
  );
});
afterEach(() => vi.useRealTimers());

function send(type: string, of: { button?: number; deltaY?: number }): boolean {
  const event = Object.assign(new Event(type, { cancelable: true }), { button: 0, ...of });
  (type === "mouseup" ? window : canvas).dispatchEvent(event);
  return event.defaultPrevented;
}

test("a notch of the wheel moves the held string a little nearer or further, and is the page's own with none", () => {
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

test("moves nearer what a pointer pulls", () => {
  hands.claim(LEFT_HAND, "pointer");
  send("wheel", { deltaY: 100 });
  velocity.update(0);
  expect([velocity.depthInput(LEFT_HAND), velocity.depthInput(1), hands.source(LEFT_HAND)]).toEqual([1, 0, "pointer"]);
  vi.advanceTimersByTime(120);
  velocity.update(16);
  expect(velocity.depthInput(LEFT_HAND)).toBe(0);
});

test("further buttons do what they are bound to, once a press; the first is the pointer's", () => {
  mapping = bind(bind(DEFAULT_MAPPING, "mouse:2", "keep"), "mouse:1", "left_leg+");
  expect([
    send("mousedown", { button: 2 }),
    send("mousedown", { button: 0 }),
    send("mousedown", { button: 3 }),
  ]).toEqual([true, false, false]);
  expect([told, send("contextmenu", { button: 2 })]).toEqual([["keep"], true]);
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
