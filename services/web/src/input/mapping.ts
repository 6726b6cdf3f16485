/**
 * Mapping from physical controls to commands, as data. Pure.
 *
 * A control is a key position (`KeyboardEvent.code`), an additional mouse button (`mouse:1`, as `MouseEvent.button`),
 * the wheel (`wheel:+`, towards the user), or on a gamepad of the W3C standard layout a button (`button:7`) or half an
 * axis (`axis:0+`). Two words are a control with a button held (`button:4 axis:1-`): it replaces the bindings of the
 * control alone, and an empty list disables the control.
 */
import { LIMBS } from "../motion/skeleton";
import { DIGITAL_INPUTS, type DigitalInput, SELECTED_LIMB_INPUTS, type SelectedLimbInput } from "./digital-input";

export type Control = string;
export const ACTIONS = [
  "take_right_hand",
  "take_left_hand",
  "take_right_leg",
  "take_left_leg",
  "next_dancer",
  "ask",
  "give",
  "join",
  "prop",
  "play",
  "back",
  "forward",
  "camera",
  "sound",
  "keep",
  "picture",
  "library",
  "strings",
  "line",
] as const;
export type Action = (typeof ACTIONS)[number];
/** Action that claims no limb. */
export type PageAction = Exclude<Action, `take_${string}`>;
export type Command = DigitalInput | SelectedLimbInput | Action;

export interface Mapping {
  readonly bindings: Readonly<Record<Control, readonly Command[]>>;
  /** Dead zone of the sticks, 0 to `MAX_DEAD_ZONE`. */
  readonly deadZone: number;
  /** Smoothing of sticks and pointers, 0 (none) to 1. */
  readonly stickSmoothing: number;
  readonly pointerSmoothing: number;
}

export const MAX_DEAD_ZONE = 0.5;
const MAX_CONTROLS = 400;
const ALL_COMMANDS: ReadonlySet<unknown> = new Set<Command>([...DIGITAL_INPUTS, ...SELECTED_LIMB_INPUTS, ...ACTIONS]);
const CONTROL_PATTERN =
  /^(button:\d{1,2} )?(button:\d{1,2}|axis:\d{1,2}[+-])$|^(mouse:[1-4]|wheel:[+-])$|^[A-Z][A-Za-z0-9]{0,31}$/;

/** One key claims a limb and six keys move it; a stick moves a hand, or a leg while its shoulder button is held. */
export const DEFAULT_MAPPING: Mapping = {
  bindings: {
    Digit1: ["take_right_hand"],
    Digit2: ["take_left_hand"],
    Digit3: ["take_right_leg"],
    Digit4: ["take_left_leg"],
    Numpad1: ["take_right_hand"],
    Numpad2: ["take_left_hand"],
    Numpad3: ["take_right_leg"],
    Numpad4: ["take_left_leg"],
    KeyD: ["held_x+"],
    KeyA: ["held_x-"],
    KeyW: ["held_y+"],
    KeyS: ["held_y-", "strings"],
    KeyQ: ["held_z+"],
    KeyE: ["held_z-"],
    ArrowRight: ["held_x+", "forward"],
    ArrowLeft: ["held_x-", "back"],
    ArrowUp: ["held_y+"],
    ArrowDown: ["held_y-"],
    PageDown: ["held_z+"],
    PageUp: ["held_z-"],
    "wheel:+": ["held_z+"],
    "wheel:-": ["held_z-"],
    KeyT: ["next_dancer"],
    KeyR: ["ask"],
    KeyG: ["give"],
    KeyJ: ["join"],
    KeyF: ["prop"],
    KeyK: ["keep"],
    KeyP: ["picture"],
    KeyM: ["sound"],
    KeyC: ["camera"],
    Space: ["play"],
    KeyL: ["library"],
    KeyN: ["line"],
    "axis:0+": ["left_hand_x+"],
    "axis:0-": ["left_hand_x-"],
    "axis:1-": ["left_hand_y+"],
    "axis:1+": ["left_hand_y-"],
    "axis:2+": ["right_hand_x+"],
    "axis:2-": ["right_hand_x-"],
    "axis:3-": ["right_hand_y+"],
    "axis:3+": ["right_hand_y-"],
    "button:6": ["left_hand_z+"],
    "button:4 button:6": ["left_hand_z-"],
    "button:7": ["right_hand_z+"],
    "button:5 button:7": ["right_hand_z-"],
    "button:4 axis:1-": ["left_leg+"],
    "button:4 axis:1+": ["left_leg-"],
    "button:4 axis:0+": [],
    "button:4 axis:0-": [],
    "button:5 axis:3-": ["right_leg+"],
    "button:5 axis:3+": ["right_leg-"],
    "button:5 axis:2+": [],
    "button:5 axis:2-": [],
    "button:0": ["play"],
    "button:14": ["back"],
    "button:15": ["forward"],
    "button:12": ["next_dancer"],
    "button:2": ["give"],
    "button:3": ["ask"],
  },
  deadZone: 0.16,
  stickSmoothing: 0.25,
  pointerSmoothing: 0,
};

/** Return the limb that a command claims, or null. */
export function limbOfCommand(command: Command): number | null {
  const limb = command.startsWith("take_") ? (LIMBS as readonly string[]).indexOf(command.slice("take_".length)) : -1;
  return limb < 0 ? null : limb;
}

export function isSelectedLimbInput(command: Command): command is SelectedLimbInput {
  return command.startsWith("held_");
}

export function isPageAction(command: Command): command is PageAction {
  return (ACTIONS as readonly string[]).includes(command) && limbOfCommand(command) === null;
}

export function isPadControl(control: Control): boolean {
  return /^(button|axis):/.test(control);
}

/** Return the commands of a control that apply now: those of the selected limb if there is one, else the others. */
export function activeCommands(commands: readonly Command[], isLimbSelected: boolean): readonly Command[] {
  const held = commands.filter(isSelectedLimbInput);
  return isLimbSelected && held.length > 0 ? held : commands.filter((command) => !isSelectedLimbInput(command));
}

/** Return the controls bound to a command, in the mapping's order. */
export function controlsOf({ bindings }: Mapping, command: Command): Control[] {
  return Object.keys(bindings).filter((control) => bindings[control].includes(command));
}

/**
 * Return the other commands that a control triggers at the same time. Commands of the selected limb exclude all others,
 * so the two kinds never conflict.
 */
export function conflictsOf({ bindings }: Mapping, control: Control, command: Command): Command[] {
  return (bindings[control] ?? []).filter(
    (other) => other !== command && isSelectedLimbInput(other) === isSelectedLimbInput(command),
  );
}

/** Return the mapping with an additional binding. */
export function bind(mapping: Mapping, control: Control, command: Command): Mapping {
  const existing = mapping.bindings[control] ?? [];
  if (existing.includes(command)) return mapping;
  return { ...mapping, bindings: { ...mapping.bindings, [control]: [...existing, command] } };
}

/** Return the mapping without a binding. */
export function unbind(mapping: Mapping, control: Control, command: Command): Mapping {
  const rest = (mapping.bindings[control] ?? []).filter((one) => one !== command);
  const { [control]: _, ...others } = mapping.bindings;
  // A control with a button held stays, so that the bindings of the control alone remain disabled.
  return { ...mapping, bindings: rest.length > 0 || control.includes(" ") ? { ...others, [control]: rest } : others };
}

/** Return a mapping from unvalidated data, or null if it is invalid. */
export function parseMapping(value: unknown): Mapping | null {
  if (!isRecord(value) || !isRecord(value.bindings)) return null;
  const { deadZone, stickSmoothing, pointerSmoothing } = value;
  if (!isInRange(deadZone, MAX_DEAD_ZONE) || !isInRange(stickSmoothing, 1) || !isInRange(pointerSmoothing, 1))
    return null;
  const entries = Object.entries(value.bindings);
  const isValid = entries.every(
    ([control, commands]) =>
      CONTROL_PATTERN.test(control) && Array.isArray(commands) && commands.every((one) => ALL_COMMANDS.has(one)),
  );
  if (!isValid || entries.length > MAX_CONTROLS) return null;
  const bindings = Object.fromEntries(
    entries.map(([control, commands]) => [control, [...new Set(commands as Command[])]]),
  );
  return { bindings, deadZone, stickSmoothing, pointerSmoothing };
}

function isRecord(value: unknown): value is Record<string, unknown> {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

function isInRange(value: unknown, max: number): value is number {
  return typeof value === "number" && value >= 0 && value <= max;
}
