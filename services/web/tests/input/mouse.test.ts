import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { Commands } from "../../src/input/commands";
import type { Hands } from "../../src/input/hands";
import { bind, DEFAULT_MAPPING, type Mapping } from "../../src/input/mapping";
import { listenToMouse, mouseControl } from "../../src/input/mouse";
import { VelocityInputs } from "../../src/input/velocity";
import { standingPuppet } from "../stage/standard-figure";
import { deeds } from "./deeds";
import { handsBefore, Session } from "./session";

const LEFT_HAND = 0;

let canvas: EventTarget;
let window: EventTarget;
let hands: Hands;
let velocity: VelocityInputs;
let session: Session;
let told: string[];
let mapping: Mapping;

beforeEach(() => {
  vi.useFakeTimers();
  [canvas, window, session, told, mapping] = [new EventTarget(), new EventTarget(), new Session(), [], DEFAULT_MAPPING];
  hands = handsBefore(standingPuppet(), session);
  velocity = new VelocityInputs(hands, { take: (limb) => hands.take(limb, "velocity"), free: (limb) => hands.source(limb) === null });
  listenToMouse(canvas as HTMLElement, window, new Commands(hands, velocity, deeds(told)), () => mapping);
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
  session.take();
  expect(send("wheel", { deltaY: 100 })).toBe(true);
  velocity.update(0);
  vi.advanceTimersByTime(60);
  send("wheel", { deltaY: 100 });
  vi.advanceTimersByTime(100);
  velocity.update(16);
  expect(session.take()).toEqual([["velocity", LEFT_HAND, 0, 0, 1], ["velocity", LEFT_HAND, 0, 0, 1]]);
  send("wheel", { deltaY: -100 });
  velocity.update(32);
  vi.advanceTimersByTime(120);
  velocity.update(48);
  expect(session.take()).toEqual([["velocity", LEFT_HAND, 0, 0, -1], ["velocity", LEFT_HAND, 0, 0, 0]]);
});

test("moves nearer what a pointer pulls", () => {
  hands.take(LEFT_HAND, "pointer");
  send("wheel", { deltaY: 100 });
  velocity.update(0);
  expect([velocity.nearer(LEFT_HAND), velocity.nearer(1), hands.source(LEFT_HAND)]).toEqual([1, 0, "pointer"]);
  vi.advanceTimersByTime(120);
  velocity.update(16);
  expect(velocity.nearer(LEFT_HAND)).toBe(0);
});

test("further buttons do what they are bound to, once a press; the first is the pointer's", () => {
  mapping = bind(bind(DEFAULT_MAPPING, "mouse:2", "keep"), "mouse:1", "left_leg+");
  expect([send("mousedown", { button: 2 }), send("mousedown", { button: 0 }), send("mousedown", { button: 3 })]).toEqual([true, false, false]);
  expect([told, send("contextmenu", { button: 2 })]).toEqual([["keep"], true]);
  send("mousedown", { button: 1 });
  velocity.update(0);
  send("mouseup", { button: 1 });
  velocity.update(16);
  expect(session.take()).toEqual([["claim", 2], ["velocity", 2, 1, 0, 0], ["velocity", 2, 0, 0, 0]]);
  expect(mouseControl({ type: "wheel", deltaY: 0, button: 0 } as unknown as MouseEvent)).toBe(null);
});
