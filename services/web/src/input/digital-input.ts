/**
 * The 14 inputs of a puppeteer (paper, section 5; proto/server.md, 6.3) by name. Pure.
 *
 * A hand has six inputs, plus and minus along x, y and z; a leg has one, its angle: 2 x 6 + 2 x 1 = 14. A hand's inputs
 * are buttons. A leg's input goes both ways and takes two buttons, so that 16 digital inputs stand for the 14. Each
 * digital input has a strength, 0 to 1: a button has one of the two, a stick or trigger any value between. Directions
 * are the audience's: x to the right, y up, z towards the audience.
 */
import { LIMBS } from "../motion/skeleton";

type Side = "left" | "right";
type Sign = "+" | "-";
export type DigitalInput = `${Side}_hand_${"x" | "y" | "z"}${Sign}` | `${Side}_leg${Sign}`;
/** Inputs of the selected limb, so that six keys serve all four limbs. */
export type SelectedLimbInput = `held_${"x" | "y" | "z"}${Sign}`;

/** Right, up and towards the audience; -1 to 1 of full speed each. */
export type Direction = readonly [right: number, up: number, nearer: number];

const HANDS = LIMBS.filter((limb) => limb.endsWith("hand"));
const LEGS = LIMBS.filter((limb) => limb.endsWith("leg"));
const AXES = ["x", "y", "z"] as const;
const SIGNS = ["+", "-"] as const;
const directionInputs = (limb: string) => AXES.flatMap((axis) => SIGNS.map((sign) => `${limb}_${axis}${sign}`));

/** The 14 inputs of the paper. */
export const PAPER_INPUTS: readonly string[] = [...HANDS.flatMap(directionInputs), ...LEGS];
/** The 14 inputs as buttons: two per leg. */
export const DIGITAL_INPUTS = [
  ...HANDS.flatMap(directionInputs),
  ...LEGS.flatMap((leg) => SIGNS.map((sign) => `${leg}${sign}`)),
] as readonly DigitalInput[];
export const SELECTED_LIMB_INPUTS = directionInputs("held") as readonly SelectedLimbInput[];

/** Effect of an input: limb (null for the selected one), axis and direction. */
export interface InputEffect {
  limb: number | null;
  axis: 0 | 1 | 2;
  sign: 1 | -1;
}

const EFFECTS = new Map<string, InputEffect>(
  [...DIGITAL_INPUTS, ...SELECTED_LIMB_INPUTS].map((input) => {
    const limb = LIMBS.findIndex((name) => input.startsWith(name));
    // A leg's angle is the vertical axis.
    const axis = Math.max(
      AXES.findIndex((one) => input.slice(0, -1).endsWith(`_${one}`)),
      input.includes("leg") ? 1 : 0,
    ) as InputEffect["axis"];
    return [input, { limb: limb < 0 ? null : limb, axis, sign: input.endsWith("+") ? 1 : -1 }];
  }),
);

export function isLimbInput(command: string): command is DigitalInput | SelectedLimbInput {
  return EFFECTS.has(command);
}

export function effectOf(input: DigitalInput | SelectedLimbInput): InputEffect {
  return EFFECTS.get(input) as InputEffect;
}

/**
 * Return the direction of the inputs of one limb, held at strengths of 0 to 1. Opposite inputs cancel, repeated ones
 * count once, and a diagonal is no faster than a straight line.
 */
export function combineDirections(
  pressed: Iterable<readonly [input: DigitalInput | SelectedLimbInput, strength: number]>,
): Direction {
  const strengths: [number, number][] = [
    [0, 0],
    [0, 0],
    [0, 0],
  ];
  for (const [input, strength] of pressed) {
    const { axis, sign } = effectOf(input);
    const index = sign > 0 ? 0 : 1;
    strengths[axis][index] = Math.max(strengths[axis][index], Math.min(Math.max(strength, 0), 1));
  }
  const sum = strengths.map(([plus, minus]) => plus - minus);
  const length = Math.max(1, Math.hypot(...sum));
  return [sum[0] / length, sum[1] / length, sum[2] / length];
}
