import { Vector3 } from "three";
import { beforeEach, expect, test } from "vitest";
import type { ClaimController } from "../../src/engine/claim-controller";
import { ImmersiveController } from "../../src/engine/immersive-controller";
import type { StageContent, StageController } from "../../src/engine/stage-controller";
import type { HandState, Triple } from "../../src/input/hand";
import type { LimbController } from "../../src/input/limb-controller";
import { DEFAULT_MAPPING } from "../../src/input/mapping";
import { PerformerSelection } from "../../src/input/performer-selection";
import { type Figure, restPose } from "../../src/motion/skeleton";
import { createLimbController, FakePuppeteer } from "../input/fake-puppeteer";
import { createStandingPuppet } from "../stage/puppet/figures";

const LEFT_HAND = 0;
const PROPS = [{ prop: 0, kind: "fan", limb: LEFT_HAND, place: [0, 0, 0] }];
const puppet = createStandingPuppet();

let hands: LimbController;
let figures: readonly Figure[];
let viewOnly: boolean;
let highlighted: readonly (number | null)[];
let immersive: ImmersiveController;

beforeEach(() => {
  hands = createLimbController(puppet, new FakePuppeteer());
  [figures, viewOnly, highlighted] = [[puppet.figure], false, []];
  const pose = restPose();
  pose.root.set([0, 2, 0]);
  const controller = {
    stage: { performers: [puppet] },
    hands,
    selectedPerformer: 0,
    front: 0.5,
    get figures() {
      return figures;
    },
    advance(_: number, limbs: readonly (number | null)[]): StageContent {
      highlighted = limbs;
      const pullTarget = hands.pullTarget(LEFT_HAND);
      const strings = [{ puppeteer: 0, isHighlighted: true, pullTarget }];
      return { poses: [pose], limbs: [], strings, lights: [], props: PROPS, seconds: 0 };
    },
  };
  const claims = {
    get viewOnly() {
      return viewOnly;
    },
    canPull: () => true,
    limbStates: () => [],
    selectedPerformer: new PerformerSelection(),
  };
  immersive = new ImmersiveController(controller as unknown as StageController, claims as unknown as ClaimController, {
    mapping: { ...DEFAULT_MAPPING, pointerSmoothing: 0 },
  });
});

/** State of a hand that is closed on the ring of the left hand. */
function closedHand(): HandState {
  const position = puppet.handle(LEFT_HAND, new Vector3()).toArray() as Triple;
  return { name: "right", position, origin: position, direction: [0, 0, 1], reach: 0.1, isClosed: true };
}

test("a frame can be sent to another realm, and has the pull of the hand", () => {
  const hand = closedHand();
  const frame = immersive.advance(0, [hand]);
  expect(structuredClone(frame)).toEqual(frame);
  expect(frame?.grips).toEqual([{ name: "right", kind: "holding", limb: LEFT_HAND }]);
  expect([frame?.front, frame?.performer, highlighted]).toEqual([0.5, 0, [LEFT_HAND]]);
  expect(frame?.props).toEqual(PROPS);
  frame?.strings[0].pullTarget?.forEach((value, axis) => expect(value).toBeCloseTo(hand.position[axis]));
});

test("the performers take their poses, in whose frames limbs are pulled", () => {
  puppet.group.visible = false;
  immersive.advance(0, []);
  expect(puppet.group.visible).toBe(true);
  expect(new Vector3().setFromMatrixPosition(puppet.root).y).toBeCloseTo(2);
});

test("figures are sent once, after a change, and to the next session", () => {
  const isSent = () => immersive.advance(0, [])?.figures === figures;
  expect([isSent(), isSent()]).toEqual([true, false]);
  figures = [puppet.figure, puppet.figure];
  expect([isSent(), isSent()]).toEqual([true, false]);
  immersive.advance(0, null);
  expect(isSent()).toBe(true);
});

test("the end of the session releases the limbs", () => {
  immersive.advance(0, [closedHand()]);
  expect(hands.source(LEFT_HAND)).toBe("pointer");
  expect(immersive.advance(0, null)).toBe(null);
  expect(hands.source(LEFT_HAND)).toBe(null);
});

test("a page that may not control holds nothing", () => {
  viewOnly = true;
  expect(immersive.advance(0, [closedHand()])?.grips).toEqual([]);
  expect(hands.source(LEFT_HAND)).toBe(null);
});
