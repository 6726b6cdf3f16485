/** Commands as people read them. Pure. */
import { DIGITAL_INPUTS, effectOf, HELD_INPUTS, isInput } from "../input/inputs";
import { limbTaken, type Action, type Command } from "../input/mapping";
import { LIMB_NAMES } from "./model";
import { series, say, type Plain } from "../words/say";

const WAYS = [["left", "right"], ["down", "up"], ["further", "nearer"]] as const;
const ACTIONS: Readonly<Record<Exclude<Action, `take_${string}`>, Plain>> = {
  next_dancer: "next dancer", ask: "ask for the string that another holds", give: "give the string that is asked for",
  play: "play or pause", back: "seek back by one block", forward: "seek forward by one block", camera: "the show's camera, or your own seat", sound: "sound on or off", keep: "keep this as a new dance", picture: "save a picture of the stage",
  library: "library", strings: "strings", line: "line",
};

/** "right", "nearer": which way an input goes, to be said. */
export function wayName(input: Parameters<typeof effectOf>[0]): (typeof WAYS)[number][number] {
  const { axis, sign } = effectOf(input);
  return WAYS[axis][sign > 0 ? 1 : 0];
}

/** "take or let go the left hand", "left leg up", "play or pause". */
export function commandName(command: Command): string {
  if (isInput(command)) {
    const { limb } = effectOf(command);
    const way = say(wayName(command));
    return limb === null ? say("pull the held string {way}", { way }) : say("{limb} {way}", { limb: say(LIMB_NAMES[limb]).toLowerCase(), way });
  }
  const limb = limbTaken(command);
  return limb === null ? say(ACTIONS[command as keyof typeof ACTIONS]) : say("take or let go the {limb}", { limb: say(LIMB_NAMES[limb]).toLowerCase() });
}

/**
 * Commands in a few words, for a part of the drawn gamepad: a limb that all of its ways move by its name alone; of `own`, the limb named beside it, only the
 * ways.
 */
export function summary(commands: readonly Command[], own: number | null = null): string {
  const words = commands.map((command) => {
    if (!isInput(command)) return commandName(command);
    const { limb } = effectOf(command);
    const ways = commands.filter((other) => isInput(other) && effectOf(other).limb === limb);
    if (ways.length > 1) return limb === null ? say("held string") : say(LIMB_NAMES[limb]).toLowerCase();
    return limb === own && limb !== null ? say(wayName(command)) : commandName(command);
  });
  const text = series([...new Set(words)]);
  return text.charAt(0).toUpperCase() + text.slice(1);
}

/** The commands in the order of the list of keys, in three groups. */
export const GROUPS: readonly (readonly Command[])[] = [
  ["take_right_hand", "take_left_hand", "take_right_leg", "take_left_leg", ...[2, 3, 1, 0, 4, 5].map((i) => HELD_INPUTS[i]), "next_dancer", "ask", "give"],
  ["play", "back", "forward", "camera", "sound", "keep", "picture", "library", "strings", "line"],
  DIGITAL_INPUTS,
];
