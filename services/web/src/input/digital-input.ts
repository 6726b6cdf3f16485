/**
 * The 14 inputs of a puppeteer's hands (paper 5; SPEC, Ownership), by name. Pure.
 *
 * A hand has six, plus and minus along x, y and z; a leg has one, its angle: 2 x 6 + 2 x 1 = 14. A hand's inputs are buttons as they stand. A leg's one input
 * goes both ways, so as buttons it is a pair: 16 digital inputs for the 14. Here a digital input also has a strength, 0 to 1: a button has one of the two, a
 * stick or trigger anything between. Directions are the audience's: x to its right, y up, z nearer to it.
 */
import { LIMBS } from "../motion/skeleton";

type Side = "left" | "right";
type Sign = "+" | "-";
export type DigitalInput = `${Side}_hand_${"x" | "y" | "z"}${Sign}` | `${Side}_leg${Sign}`;
/** The same for whichever limb is selected, so that six keys can serve all four. */
export type SelectedLimbInput = `held_${"x" | "y" | "z"}${Sign}`;

/** To the audience's right, up, nearer to it; -1 to 1 of full speed each. */
export type Direction = readonly [right: number, up: number, nearer: number];

const HANDS = LIMBS.filter((limb) => limb.endsWith("hand"));
const LEGS = LIMBS.filter((limb) => limb.endsWith("leg"));
const AXES = ["x", "y", "z"] as const;
const SIGNS = ["+", "-"] as const;
const directionInputs = (limb: string) => AXES.flatMap((axis) => SIGNS.map((sign) => `${limb}_${axis}${sign}`));

/** The paper's 14. */
export const PAPER_INPUTS: readonly string[] = [...HANDS.flatMap(directionInputs), ...LEGS];
/** The same as buttons: a leg's is a pair. */
export const DIGITAL_INPUTS = [
  ...HANDS.flatMap(directionInputs),
  ...LEGS.flatMap((leg) => SIGNS.map((sign) => `${leg}${sign}`)),
] as readonly DigitalInput[];
export const SELECTED_LIMB_INPUTS = directionInputs("held") as readonly SelectedLimbInput[];

/** What an input does: of which limb (null for the selected one), along which axis, which way. */
export interface InputEffect {
  limb: number | null;
  axis: 0 | 1 | 2;
  sign: 1 | -1;
}

const EFFECTS = new Map<string, InputEffect>(
  [...DIGITAL_INPUTS, ...SELECTED_LIMB_INPUTS].map((input) => {
    const limb = LIMBS.findIndex((name) => input.startsWith(name));
    // a leg's angle goes up and down
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
 * The direction of inputs held at strengths of 0 to 1, all of one limb: opposite ones cancel, the same one held twice counts once, and a slant is no faster
 * than a straight line.
 */
export function combineDirections(
  pressed: Iterable<readonly [input: DigitalInput | SelectedLimbInput, strength: number]>,
): Direction {
  const most: [number, number][] = [
    [0, 0],
    [0, 0],
    [0, 0],
  ];
  for (const [input, strength] of pressed) {
    const { axis, sign } = effectOf(input);
    const way = sign > 0 ? 0 : 1;
    most[axis][way] = Math.max(most[axis][way], Math.min(Math.max(strength, 0), 1));
  }
  const sum = most.map(([plus, minus]) => plus - minus);
  const length = Math.max(1, Math.hypot(...sum));
  return [sum[0] / length, sum[1] / length, sum[2] / length];
}
