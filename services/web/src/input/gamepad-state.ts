/** What a gamepad of the W3C standard layout asks for under a mapping. Pure. */
import { isLimbInput } from "./digital-input";
import type { Command, Control, Mapping } from "./mapping";

/** What is read of a Gamepad. */
export interface GamepadState {
  axes: readonly number[];
  buttons: readonly { pressed: boolean; value: number }[];
}

/** Triggers pulled less than this rest. */
const TRIGGER_DEAD_ZONE = 0.05;
/** Where a trigger or a stick counts as pressed. */
export const PRESS_THRESHOLD = 0.5;
/** Axes of the two sticks; further ones stand alone. */
const STICK_AXES = 4;

/** A stick without its dead zone: 0 in it, then rising from 0 to 1 at the rim, direction kept. */
export function applyDeadZone(x: number, y: number, deadZone: number): readonly [number, number] {
  const length = Math.hypot(x, y);
  if (!(length > deadZone)) return [0, 0];
  const scale = (Math.min(1, length) - deadZone) / (1 - deadZone) / length;
  return [x * scale, y * scale];
}

/** Each control of the pad that is not at rest, and how far it is pressed or pushed, 0 to 1. */
export function pressedControls({ axes, buttons }: GamepadState, deadZone: number): Map<Control, number> {
  const pressed = new Map<Control, number>();
  buttons.forEach(({ value, pressed: down }, index) => {
    const depth = value > TRIGGER_DEAD_ZONE ? value : Number(down);
    if (depth > 0) pressed.set(`button:${index}`, depth);
  });
  const push = (axis: number, value: number) => {
    if (value !== 0) pressed.set(`axis:${axis}${value > 0 ? "+" : "-"}`, Math.abs(value));
  };
  for (let axis = 0; axis < axes.length; axis += axis < STICK_AXES ? 2 : 1) {
    const [x, y] = applyDeadZone(axes[axis], axis < STICK_AXES ? (axes[axis + 1] ?? 0) : 0, deadZone);
    push(axis, x);
    if (axis < STICK_AXES) push(axis + 1, y);
  }
  return pressed;
}

/** A control that is down: what it asks for, and how strongly. */
export interface ControlInput {
  control: Control;
  commands: readonly Command[];
  strength: number;
}

/** What all controls that are down ask for; one with a button held goes before the same alone. What moves no limb is down from half way on. */
export function resolveControls(state: GamepadState, mapping: Mapping): ControlInput[] {
  const pressed = pressedControls(state, mapping.deadZone);
  return [...pressed].flatMap(([alone, strength]) => {
    const chord = [...pressed.keys()].map((held) => `${held} ${alone}`).find((both) => both in mapping.bindings);
    const control = chord ?? alone;
    const commands = mapping.bindings[control] ?? [];
    const down = strength > PRESS_THRESHOLD || commands.some(isLimbInput);
    return down && commands.length > 0 ? [{ control, commands, strength }] : [];
  });
}
