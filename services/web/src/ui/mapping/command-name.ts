/** Names of commands for display. Pure. */
import { joinList, type PlainMessageKey, translate } from "../../i18n/translator";
import { DIGITAL_INPUTS, effectOf, isLimbInput, SELECTED_LIMB_INPUTS } from "../../input/digital-input";
import { type Action, type Command, limbOfCommand } from "../../input/mapping";
import { LIMB_NAMES } from "../limb-state";

const DIRECTIONS = [
  ["left", "right"],
  ["down", "up"],
  ["further", "nearer"],
] as const;
const ACTION_NAMES: Readonly<Record<Exclude<Action, `take_${string}`>, PlainMessageKey>> = {
  next_dancer: "next dancer",
  ask: "ask for a string that someone else holds",
  give: "give a requested string",
  join: "join or part hands",
  prop: "take or lay down a prop",
  play: "play or pause",
  back: "seek back by one block",
  forward: "seek forward by one block",
  camera: "the show's camera or your own view",
  sound: "sound on or off",
  keep: "keep this as a new dance",
  picture: "save a picture of the stage",
  library: "library",
  strings: "strings",
  line: "connection",
};

/** Return the direction of an input, "right" or "nearer"; translate it before display. */
export function directionName(input: Parameters<typeof effectOf>[0]): (typeof DIRECTIONS)[number][number] {
  const { axis, sign } = effectOf(input);
  return DIRECTIONS[axis][sign > 0 ? 1 : 0];
}

/** Name a command: "take or release the left hand", "left leg up", "play or pause". */
export function commandName(command: Command): string {
  if (isLimbInput(command)) {
    const { limb } = effectOf(command);
    const way = translate(directionName(command));
    return limb === null
      ? translate("pull the held string {way}", { way })
      : translate("{limb} {way}", { limb: translate(LIMB_NAMES[limb]).toLowerCase(), way });
  }
  const limb = limbOfCommand(command);
  return limb === null
    ? translate(ACTION_NAMES[command as keyof typeof ACTION_NAMES])
    : translate("take or release the {limb}", { limb: translate(LIMB_NAMES[limb]).toLowerCase() });
}

/**
 * Summarise the commands of one part of the gamepad drawing. A limb that several of them move is named once; for the
 * limb `ownLimb`, whose name stands beside the part, only directions are named.
 */
export function summarizeCommands(commands: readonly Command[], ownLimb: number | null = null): string {
  const names = commands.map((command) => {
    if (!isLimbInput(command)) return commandName(command);
    const { limb } = effectOf(command);
    const sameLimb = commands.filter((other) => isLimbInput(other) && effectOf(other).limb === limb);
    if (sameLimb.length > 1)
      return limb === null ? translate("held string") : translate(LIMB_NAMES[limb]).toLowerCase();
    return limb === ownLimb && limb !== null ? translate(directionName(command)) : commandName(command);
  });
  const text = joinList([...new Set(names)]);
  return text.charAt(0).toUpperCase() + text.slice(1);
}

/** All commands in the order of the mapping editor, in three groups. */
export const COMMAND_GROUPS: readonly (readonly Command[])[] = [
  [
    "take_right_hand",
    "take_left_hand",
    "take_right_leg",
    "take_left_leg",
    ...[2, 3, 1, 0, 4, 5].map((i) => SELECTED_LIMB_INPUTS[i]),
    "next_dancer",
    "ask",
    "give",
    "join",
    "prop",
  ],
  ["play", "back", "forward", "camera", "sound", "keep", "picture", "library", "strings", "line"],
  DIGITAL_INPUTS,
];
