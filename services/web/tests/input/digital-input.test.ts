import fc from "fast-check";
import { describe, expect, test } from "vitest";
import {
  combineDirections,
  DIGITAL_INPUTS,
  effectOf,
  isLimbInput,
  PAPER_INPUTS,
  SELECTED_LIMB_INPUTS,
} from "../../src/input/digital-input";

test("there are the paper's 14 inputs, or 16 buttons", () => {
  expect(PAPER_INPUTS).toHaveLength(14);
  expect(new Set(PAPER_INPUTS).size).toBe(14);
  expect(PAPER_INPUTS.slice(0, 6)).toEqual([
    "left_hand_x+",
    "left_hand_x-",
    "left_hand_y+",
    "left_hand_y-",
    "left_hand_z+",
    "left_hand_z-",
  ]);
  expect(PAPER_INPUTS.slice(12)).toEqual(["left_leg", "right_leg"]);
  expect(DIGITAL_INPUTS).toHaveLength(16);
  expect(new Set(DIGITAL_INPUTS.map((input) => input.replace(/(leg)[+-]$/, "$1")))).toEqual(new Set(PAPER_INPUTS));
});

test("each input has its own limb, axis and sign", () => {
  expect(effectOf("left_hand_x-")).toEqual({ limb: 0, axis: 0, sign: -1 });
  expect(effectOf("right_hand_z+")).toEqual({ limb: 1, axis: 2, sign: 1 });
  expect(effectOf("left_leg+")).toEqual({ limb: 2, axis: 1, sign: 1 });
  expect(effectOf("right_leg-")).toEqual({ limb: 3, axis: 1, sign: -1 });
  expect(effectOf("held_y+")).toEqual({ limb: null, axis: 1, sign: 1 });
  const effects = [...DIGITAL_INPUTS, ...SELECTED_LIMB_INPUTS].map((input) => JSON.stringify(effectOf(input)));
  expect(new Set(effects).size).toBe(22);
  expect(["left_hand_x", "play", ""].map(isLimbInput)).toEqual([false, false, false]);
});

describe("directions", () => {
  const strength = fc.double({ min: 0, max: 1, noNaN: true });
  const held = fc.array(fc.tuple(fc.constantFrom(...DIGITAL_INPUTS.slice(0, 6)), strength), { maxLength: 8 });

  test("cancel opposite inputs, and count repeated ones once", () => {
    expect(combineDirections([["left_hand_x+", 1]])).toEqual([1, 0, 0]);
    expect(
      combineDirections([
        ["left_hand_x+", 1],
        ["left_hand_x-", 1],
        ["held_z-", 1],
      ]),
    ).toEqual([0, 0, -1]);
    expect(
      combineDirections([
        ["held_y+", 1],
        ["left_hand_y+", 1],
      ]),
    ).toEqual([0, 1, 0]);
    expect(
      Math.hypot(
        ...combineDirections([
          ["held_y+", 1],
          ["held_x+", 1],
          ["held_z+", 1],
        ]),
      ),
    ).toBeCloseTo(1, 12);
    expect(combineDirections([["left_hand_x+", 0.5]])).toEqual([0.5, 0, 0]);
    expect(combineDirections([])).toEqual([0, 0, 0]);
  });

  test("never exceed full speed, in any order of inputs", () => {
    fc.assert(
      fc.property(held, (inputs) => {
        const direction = combineDirections(inputs);
        expect(Math.hypot(...direction)).toBeLessThanOrEqual(1 + 1e-12);
        expect(combineDirections([...inputs].reverse())).toEqual(direction);
      }),
    );
  });

  test("of a leg are up or down", () => {
    expect(combineDirections([["left_leg+", 1]])).toEqual([0, 1, 0]);
    expect(combineDirections([["right_leg-", 0.25]])).toEqual([0, -0.25, 0]);
  });
});
