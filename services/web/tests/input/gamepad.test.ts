import { beforeEach, expect, test } from "vitest";
import { createGamepad, type GamepadInput } from "../../src/input/gamepad";
import { BUTTON } from "../../src/input/gamepad-mapping";
import type { Hands } from "../../src/input/hands";
import { standingPuppet } from "../stage/standard-figure";
import { handsBefore, Session } from "./session";

const LEFT_HAND = 0;

let session: Session;
let hands: Hands;
let pads: (Gamepad | null)[];
let input: GamepadInput;
let told: string[];
let free: boolean;

/** A pad as the browser tells of it. */
function pad(axes = [0, 0, 0, 0], pressed: readonly number[] = [], mapping = "standard"): Gamepad {
  const buttons = Array.from({ length: 17 }, (_, i) => ({ pressed: pressed.includes(i), touched: false, value: Number(pressed.includes(i)) }));
  return { connected: true, mapping, axes, buttons } as unknown as Gamepad;
}

beforeEach(() => {
  session = new Session();
  hands = handsBefore(standingPuppet(), session);
  pads = [];
  told = [];
  free = true;
  input = createGamepad(
    hands,
    {
      take: (limb) => {
        told.push(`take ${limb}`);
        return free && hands.take(limb, "pad");
      },
      play: () => told.push("play"),
      step: (blocks) => told.push(`step ${blocks}`),
    },
    () => pads,
  );
});

test("a stick that is moved takes its hand and moves it", () => {
  pads = [pad([1, 0, 0, 0])];
  input.update(0);
  expect(told).toEqual(["take 0"]);
  expect(session.take()).toEqual([["claim", LEFT_HAND], ["velocity", LEFT_HAND, 1, 0, 0]]);
  input.update(16);
  expect(told).toEqual(["take 0"]);
});

test("a stick at rest stops its hand at once, and gives it back to the dance a while later", () => {
  pads = [pad([0, -1, 0, 0])];
  input.update(0);
  pads = [pad()];
  input.update(100);
  expect(session.said.at(-1)).toEqual(["velocity", LEFT_HAND, 0, 0, 0]);
  input.update(700);
  expect(hands.source(LEFT_HAND)).toBe("pad");
  input.update(701);
  expect(hands.source(LEFT_HAND)).toBe(null);
  expect(session.said.at(-1)).toEqual(["release", LEFT_HAND]);
  // And can be had again at once.
  pads = [pad([0, -1, 0, 0])];
  input.update(717);
  expect(hands.source(LEFT_HAND)).toBe("pad");
});

test("a limb that another holds is asked for again now and then, not with every frame", () => {
  free = false;
  pads = [pad([1, 0, 0, 0])];
  for (let now = 0; now <= 3200; now += 16) input.update(now);
  expect(told).toEqual(["take 0", "take 0", "take 0"]);
  expect(session.said).toEqual([]);
});

test("leaves alone what the pointer holds", () => {
  hands.take(LEFT_HAND, "pointer");
  session.take();
  pads = [pad([1, 0, 0, 0])];
  input.update(0);
  pads = [];
  input.update(16);
  expect(hands.source(LEFT_HAND)).toBe("pointer");
  expect([told, session.said]).toEqual([[], []]);
});

test("a pad that is pulled out lets go of all it holds", () => {
  pads = [pad([1, 0, -1, 0])];
  input.update(0);
  expect([hands.source(0), hands.source(1)]).toEqual(["pad", "pad"]);
  pads = [null];
  input.update(16);
  expect([hands.source(0), hands.source(1), input.pad]).toEqual([null, null, null]);
  expect(session.said.slice(-2)).toEqual([["release", 0], ["release", 1]]);
});

test("the first pad of the standard mapping that is connected is read", () => {
  const gone = { ...pad([1, 0, 0, 0]), connected: false } as Gamepad;
  const standard = pad();
  pads = [null, gone, pad([1, 0, 0, 0], [BUTTON.play], ""), standard, pad([1, 0, 0, 0])];
  input.update(0);
  expect(input.pad).toBe(standard);
  expect(told).toEqual([]);
});

test("a button held down plays and seeks once", () => {
  pads = [pad([0, 0, 0, 0], [BUTTON.play, BUTTON.left])];
  input.update(0);
  input.update(16);
  expect(told).toEqual(["play", "step -1"]);
  pads = [pad()];
  input.update(32);
  pads = [pad([0, 0, 0, 0], [BUTTON.right])];
  input.update(48);
  expect(told).toEqual(["play", "step -1", "step 1"]);
});
