import { Vector3 } from "three";
import { beforeEach, expect, test } from "vitest";
import { type HandGrip, HandInput, type HandState, type Triple } from "../../src/input/hand";
import type { LimbController } from "../../src/input/limb-controller";
import type { Puppet } from "../../src/stage/puppet/puppet";
import { createStandingPuppet } from "../stage/puppet/figures";
import { createLimbController, FakePuppeteer } from "./fake-puppeteer";

const [LEFT_HAND, RIGHT_HAND] = [0, 1];
const FAR: Triple = [0, 0, 9];

const puppet = createStandingPuppet();

let limbs: LimbController;
let session: FakePuppeteer;
let input: HandInput;
let now: number;
let selected: number;
/** Limbs that another puppeteer holds, and those asked for. */
let foreign: Set<number>;
let asked: Set<number>;
let claimed: number[];
let smoothing: number;

beforeEach(() => {
  [session, now, selected, smoothing] = [new FakePuppeteer(), 0, 0, 0];
  [foreign, asked, claimed] = [new Set(), new Set(), []];
  use([puppet]);
});

function use(performers: readonly Puppet[]): void {
  limbs = createLimbController(performers, session);
  input = new HandInput({ performers }, limbs, {
    selectedPerformer: () => selected,
    isFree: (limb) => !foreign.has(limb) && limbs.source(limb) === null,
    isHeldByOther: (limb) => foreign.has(limb),
    onClaimed: (limb) => claimed.push(limb),
    ask: (limb) => asked.add(limb),
    isAsking: (limb) => asked.has(limb),
    withdraw: (limb) => asked.delete(limb),
    smoothing: () => smoothing,
  });
}

const ring = (limb: number, of = puppet) => of.handle(limb, new Vector3());

/** State of a hand that reaches 12 cm and points away from everything. */
function hand(position: Vector3 | Triple, isClosed: boolean, name: HandState["name"] = "right"): HandState {
  const at = (position instanceof Vector3 ? position.toArray() : position) as Triple;
  return { name, position: at, origin: at, direction: [0, 0, 1], reach: 0.12, isClosed };
}

function update(...states: HandState[]): HandGrip[] {
  now += 16;
  return input.update(states, now);
}

const pullTarget = (limb: number) => limbs.pullTarget(limb) as Vector3;

test("a hand shows the limb in its reach, takes it when it closes, and releases it when it opens", () => {
  const at = ring(LEFT_HAND).add(new Vector3(0.05, 0, 0));
  expect(update(hand(at, false))).toEqual([{ name: "right", kind: "open", limb: LEFT_HAND }]);
  expect(input.limbsInReach).toEqual([LEFT_HAND]);
  expect(limbs.source(LEFT_HAND)).toBe(null);
  expect(update(hand(at, true))).toEqual([{ name: "right", kind: "holding", limb: LEFT_HAND }]);
  expect([limbs.source(LEFT_HAND), claimed]).toEqual(["pointer", [LEFT_HAND]]);
  expect(update(hand(at, false))).toEqual([{ name: "right", kind: "open", limb: LEFT_HAND }]);
  expect(limbs.source(LEFT_HAND)).toBe(null);
});

test("a limb is pulled as far as the hand moves, from where its ring was", () => {
  const from = ring(LEFT_HAND);
  const at = from.clone().add(new Vector3(0.05, 0.03, -0.02));
  update(hand(at, true));
  expect(pullTarget(LEFT_HAND).distanceTo(from)).toBeLessThan(1e-9);
  const movement = new Vector3(0.1, 0.2, 0.3);
  update(hand(at.clone().add(movement), true));
  expect(pullTarget(LEFT_HAND).distanceTo(from.clone().add(movement))).toBeLessThan(1e-9);
});

test("two hands hold two limbs, and never the same one", () => {
  const at = ring(LEFT_HAND);
  const grips = update(hand(at, true, "left"), hand(at, true, "right"));
  expect(grips.map(({ kind, limb }) => [kind, limb])).toEqual([
    ["holding", LEFT_HAND],
    ["empty", null],
  ]);
  update(hand(at, true, "left"), hand(ring(RIGHT_HAND), false, "right"));
  update(hand(at, true, "left"), hand(ring(RIGHT_HAND), true, "right"));
  expect([limbs.source(LEFT_HAND), limbs.source(RIGHT_HAND)]).toEqual(["pointer", "pointer"]);
});

test("a hand that closes on nothing takes nothing on its way", () => {
  expect(update(hand(FAR, true))).toEqual([{ name: "right", kind: "empty", limb: null }]);
  expect(update(hand(ring(LEFT_HAND), true))).toEqual([{ name: "right", kind: "empty", limb: null }]);
  expect(session.takeCalls()).toEqual([]);
});

test("a string of another puppeteer is asked for until the hand opens", () => {
  foreign.add(LEFT_HAND);
  const at = ring(LEFT_HAND);
  expect(update(hand(at, true))).toEqual([{ name: "right", kind: "asking", limb: LEFT_HAND }]);
  expect([...asked]).toEqual([LEFT_HAND]);
  expect(update(hand(at, true))[0].kind).toBe("asking");
  update(hand(at, false));
  expect([[...asked], session.takeCalls()]).toEqual([[], []]);
});

test("a string that is granted is held from where the hand is then", () => {
  foreign.add(LEFT_HAND);
  const at = ring(LEFT_HAND);
  update(hand(at, true));
  const elsewhere = at.clone().add(new Vector3(0, 0.1, 0));
  // The engine claims it for keys at first.
  foreign.delete(LEFT_HAND);
  asked.delete(LEFT_HAND);
  limbs.claim(LEFT_HAND, "velocity");
  expect(update(hand(elsewhere, true))).toEqual([{ name: "right", kind: "holding", limb: LEFT_HAND }]);
  expect(limbs.source(LEFT_HAND)).toBe("pointer");
  expect(pullTarget(LEFT_HAND).distanceTo(ring(LEFT_HAND))).toBeLessThan(1e-9);
  update(hand(elsewhere, false));
  expect(limbs.source(LEFT_HAND)).toBe(null);
});

test("a request that lapses leaves the hand empty", () => {
  foreign.add(LEFT_HAND);
  update(hand(ring(LEFT_HAND), true));
  asked.clear();
  expect(update(hand(ring(LEFT_HAND), true))[0].kind).toBe("empty");
});

test("a limb that is lost leaves the hand empty until it opens", () => {
  const at = ring(LEFT_HAND);
  update(hand(at, true));
  limbs.onRefused(LEFT_HAND);
  expect(update(hand(at, true))).toEqual([{ name: "right", kind: "empty", limb: null }]);
  expect(update(hand(at, true))[0].kind).toBe("empty");
  update(hand(at, false));
  expect(update(hand(at, true))[0].kind).toBe("holding");
});

test("a limb that keys hold is taken over, and one that keys take over is let go", () => {
  limbs.claim(LEFT_HAND, "velocity");
  const at = ring(LEFT_HAND);
  expect(update(hand(at, true))[0].kind).toBe("holding");
  limbs.claim(LEFT_HAND, "velocity");
  expect(update(hand(at, true))[0].kind).toBe("empty");
  update(hand(at, false));
  expect(limbs.source(LEFT_HAND)).toBe("velocity");
});

test("a hand that is no longer tracked lets go, and so do all at the end", () => {
  update(hand(ring(LEFT_HAND), true, "left"), hand(ring(RIGHT_HAND), true, "right"));
  expect(update(hand(ring(RIGHT_HAND), true, "right"))).toHaveLength(1);
  expect([limbs.source(LEFT_HAND), limbs.source(RIGHT_HAND)]).toEqual([null, "pointer"]);
  input.releaseAll();
  expect([limbs.source(RIGHT_HAND), input.limbsInReach]).toEqual([null, []]);
});

test("strings of the selected performer are taken before those of others", () => {
  const other = createStandingPuppet();
  use([puppet, other]);
  selected = 1;
  const at = ring(LEFT_HAND);
  expect(update(hand(at, true))[0].limb).toBe(4);
  update(hand(at, false));
  other.group.visible = false;
  expect(update(hand(at, true))[0].limb).toBe(LEFT_HAND);
  expect(claimed).toEqual([4, LEFT_HAND]);
});

test("a limb is pointed at from afar", () => {
  const origin = ring(RIGHT_HAND).add(new Vector3(0, 0, 2));
  const state = { ...hand(origin, true), direction: [0, 0, -1] as Triple };
  expect(update(state)).toEqual([{ name: "right", kind: "holding", limb: RIGHT_HAND }]);
  expect(pullTarget(RIGHT_HAND).distanceTo(ring(RIGHT_HAND))).toBeLessThan(1e-9);
});

test("a pull is smoothed as much as that of a pointer", () => {
  smoothing = 1;
  const at = ring(LEFT_HAND);
  update(hand(at, true));
  update(hand(at.clone().add(new Vector3(0, 0.001, 0)), true));
  const lift = pullTarget(LEFT_HAND).y - ring(LEFT_HAND).y;
  expect(lift).toBeGreaterThan(0);
  expect(lift).toBeLessThan(0.0005);
});
