import { expect, test } from "vitest";
import {
  createPropTransform,
  heldTransform,
  isPropKind,
  isStoredKind,
  laidTransform,
  PROP_FORMS,
  PROP_KINDS,
  type PropKind,
  type PropTransform,
  UMBRELLA,
} from "../../src/motion/props";
import { rotate } from "../../src/motion/rotation";

const GRIP = [0.2, 1.1, -0.3];

/** Return where a point of the prop's frame is on the stage. */
function placed({ position, rotation }: PropTransform, point: readonly number[]): number[] {
  const out = new Float64Array(3);
  rotate(out, 0, rotation, 0, Float64Array.from(point), 0);
  return [...out].map((value, axis) => value + position[axis]);
}

/** Return the transform in a hand whose joint is turned so, with the grip at this place. */
function heldBy(hand: number, kind: PropKind = "fan", rotation = [1, 0, 0, 0]): PropTransform {
  const grip = { position: Float64Array.from(GRIP), rotation: Float64Array.from(rotation) };
  return heldTransform(PROP_FORMS[kind], hand, grip, createPropTransform());
}

test("a held prop points to the front of a hanging hand", () => {
  for (const hand of [0, 1]) {
    const held = heldBy(hand);
    expect([...held.position]).toEqual(GRIP);
    // x to the hand's y (up), y to its z (front), z to its x (left)
    for (let axis = 0; axis < 3; axis++) {
      const unit = [0, 1, 2].map((one) => Number(one === axis));
      placed(held, unit).forEach((value, at) =>
        expect(value - GRIP[at]).toBeCloseTo(Number(at === (axis + 1) % 3), 12),
      );
    }
  }
});

test("a held prop turns with the hand", () => {
  // The hand points forward: about x by -90 degrees.
  const [, height] = placed(heldBy(0, "fan", [Math.SQRT1_2, -Math.SQRT1_2, 0, 0]), [0, 1, 0]);
  expect(height - GRIP[1]).toBeCloseTo(1, 12);
});

test("a ball lies in the palms, which face each other", () => {
  const [left, right] = [0, 1].map((hand) => heldBy(hand, "ball").position[0] - GRIP[0]);
  expect(left).toBeCloseTo(-PROP_FORMS.ball.palmOffset, 12);
  expect(right).toBeCloseTo(PROP_FORMS.ball.palmOffset, 12);
});

test("a laid prop is at its place, turned, at the height of its kind above the floor", () => {
  for (const kind of PROP_KINDS) {
    const laid = laidTransform(PROP_FORMS[kind], [1, 2, Math.PI / 2], 0.4, createPropTransform());
    expect([...laid.position]).toEqual([1, 0.4 + PROP_FORMS[kind].rest.height, 2]);
    const [x, y, z] = placed(laid, [0, 1, 0]);
    // The front is towards x, and the shaft leans to it.
    expect(x - 1).toBeCloseTo(Math.sin(PROP_FORMS[kind].rest.pitch), 12);
    expect(y - laid.position[1]).toBeCloseTo(Math.cos(PROP_FORMS[kind].rest.pitch), 12);
    expect(z).toBeCloseTo(2, 12);
  }
});

test("a laid umbrella touches the floor with its rim and the end of its handle", () => {
  const { rimHeight, rimRadius, handleLength, handleRadius } = UMBRELLA;
  const laid = laidTransform(PROP_FORMS.umbrella, [0, 0, 0.7], 0.1, createPropTransform());
  expect(placed(laid, [0, rimHeight, rimRadius])[1]).toBeCloseTo(0.1, 12);
  expect(placed(laid, [0, -handleLength, handleRadius])[1]).toBeCloseTo(0.1, 12);
  for (let angle = 0; angle < 6.3; angle += 0.1) {
    const rim = placed(laid, [rimRadius * Math.sin(angle), rimHeight, rimRadius * Math.cos(angle)]);
    expect(rim[1]).toBeGreaterThan(0.1 - 1e-12);
  }
});

test("kinds are built-in or ids of stored props", () => {
  expect(PROP_KINDS.every(isPropKind)).toBe(true);
  expect(PROP_KINDS.some(isStoredKind)).toBe(false);
  expect(isStoredKind("abcdefghijklmnopq234")).toBe(true);
  for (const kind of [
    "",
    "sword",
    "toString",
    "abcdefghijklmnopq2345",
    "abcdefghijklmnopq01\n",
    "ABCDEFGHIJKLMNOPQ234",
  ])
    expect(isPropKind(kind) || isStoredKind(kind), kind).toBe(false);
});
