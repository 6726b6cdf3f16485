/**
 * Which physical control does what, as data. Pure.
 *
 * A control is a key's place (`KeyboardEvent.code`), a further button of the mouse (`mouse:1`, as `MouseEvent.button`) or its wheel (`wheel:+`, towards oneself), or
 * of a gamepad of the W3C standard layout a button (`button:7`) or half an axis (`axis:0+`). Two words are a control while a button is held (`button:4 axis:1-`):
 * then what the control does alone does not count, and with an empty list it does nothing.
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
export type Command = DigitalInput | SelectedLimbInput | Action;

export interface Mapping {
  readonly bindings: Readonly<Record<Control, readonly Command[]>>;
  /** Sticks nearer their middle than this rest, 0 to `DEAD_ZONE_MOST`. */
  readonly deadZone: number;
  /** How much a stick and a pointer are smoothed, 0 (not at all) to 1. */
  readonly stickSmoothing: number;
  readonly pointerSmoothing: number;
}

export const MAX_DEAD_ZONE = 0.5;
const MAX_CONTROLS = 400;
const ALL_COMMANDS: ReadonlySet<unknown> = new Set<Command>([...DIGITAL_INPUTS, ...SELECTED_LIMB_INPUTS, ...ACTIONS]);
const CONTROL_PATTERN =
  /^(button:\d{1,2} )?(button:\d{1,2}|axis:\d{1,2}[+-])$|^(mouse:[1-4]|wheel:[+-])$|^[A-Z][A-Za-z0-9]{0,31}$/;

/** A key takes a limb and six move it; a stick moves a hand, and with its shoulder button held a leg. */
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

/** The limb that a command takes, or null. */
export function limbOfCommand(command: Command): number | null {
  const limb = command.startsWith("take_") ? (LIMBS as readonly string[]).indexOf(command.slice("take_".length)) : -1;
  return limb < 0 ? null : limb;
}

export function isSelectedLimbInput(command: Command): command is SelectedLimbInput {
  return command.startsWith("held_");
}

export function isPadControl(control: Control): boolean {
  return /^(button|axis):/.test(control);
}

/** What a control means just now: while a string is held what it does with that, if anything; else the rest. */
export function activeCommands(commands: readonly Command[], isLimbSelected: boolean): readonly Command[] {
  const held = commands.filter(isSelectedLimbInput);
  return isLimbSelected && held.length > 0 ? held : commands.filter((command) => !isSelectedLimbInput(command));
}

/** The controls of a command, in the mapping's order. */
export function controlsOf({ bindings }: Mapping, command: Command): Control[] {
  return Object.keys(bindings).filter((control) => bindings[control].includes(command));
}

/** What else a control does at the same time. A command of the selected limb goes before the others, so these never meet. */
export function conflictsOf({ bindings }: Mapping, control: Control, command: Command): Command[] {
  return (bindings[control] ?? []).filter(
    (other) => other !== command && isSelectedLimbInput(other) === isSelectedLimbInput(command),
  );
}

/** The mapping with one more binding. */
export function bind(mapping: Mapping, control: Control, command: Command): Mapping {
  const there = mapping.bindings[control] ?? [];
  if (there.includes(command)) return mapping;
  return { ...mapping, bindings: { ...mapping.bindings, [control]: [...there, command] } };
}

/** The mapping with one binding less. */
export function unbind(mapping: Mapping, control: Control, command: Command): Mapping {
  const rest = (mapping.bindings[control] ?? []).filter((one) => one !== command);
  const { [control]: _, ...others } = mapping.bindings;
  // a control with a button held stays, so that what it does alone stays silent
  return { ...mapping, bindings: rest.length > 0 || control.includes(" ") ? { ...others, [control]: rest } : others };
}

/** The mapping that a value read from somewhere is, or null where it is none. */
export function parseMapping(value: unknown): Mapping | null {
  if (!isRecord(value) || !isRecord(value.bindings)) return null;
  const { deadZone, stickSmoothing, pointerSmoothing } = value;
  if (!isInRange(deadZone, MAX_DEAD_ZONE) || !isInRange(stickSmoothing, 1) || !isInRange(pointerSmoothing, 1))
    return null;
  const entries = Object.entries(value.bindings);
  const good = entries.every(
    ([control, commands]) =>
      CONTROL_PATTERN.test(control) && Array.isArray(commands) && commands.every((one) => ALL_COMMANDS.has(one)),
  );
  if (!good || entries.length > MAX_CONTROLS) return null;
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
