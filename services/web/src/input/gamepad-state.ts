/** Reading of a gamepad with the W3C standard layout under a mapping. Pure. */
import { isLimbInput } from "./digital-input";
import type { Command, Control, Mapping } from "./mapping";

/** Part of the Gamepad interface that is read. */
export interface GamepadState {
  axes: readonly number[];
  buttons: readonly { pressed: boolean; value: number }[];
}

/** Trigger values below this are zero. */
const TRIGGER_DEAD_ZONE = 0.05;
/** Value at which a trigger or a stick counts as pressed. */
export const PRESS_THRESHOLD = 0.5;
/** Axes of the two sticks; further axes are independent. */
const STICK_AXES = 4;

/** Return a stick's position without its dead zone: 0 inside, then rising to 1 at the rim, with its direction kept. */
export function applyDeadZone(x: number, y: number, deadZone: number): readonly [number, number] {
  const length = Math.hypot(x, y);
  if (!(length > deadZone)) return [0, 0];
  const scale = (Math.min(1, length) - deadZone) / (1 - deadZone) / length;
  return [x * scale, y * scale];
}

/** Return each control that is not at rest and how far it is pressed, 0 to 1. */
export function pressedControls({ axes, buttons }: GamepadState, deadZone: number): Map<Control, number> {
  const pressed = new Map<Control, number>();
  buttons.forEach(({ value, pressed: isPressed }, index) => {
    const depth = value > TRIGGER_DEAD_ZONE ? value : Number(isPressed);
    if (depth > 0) pressed.set(`button:${index}`, depth);
  });
  const add = (axis: number, value: number) => {
    if (value !== 0) pressed.set(`axis:${axis}${value > 0 ? "+" : "-"}`, Math.abs(value));
  };
  for (let axis = 0; axis < axes.length; axis += axis < STICK_AXES ? 2 : 1) {
    const [x, y] = applyDeadZone(axes[axis], axis < STICK_AXES ? (axes[axis + 1] ?? 0) : 0, deadZone);
    add(axis, x);
    if (axis < STICK_AXES) add(axis + 1, y);
  }
  return pressed;
}

/** A pressed control, its commands and its strength. */
export interface ControlInput {
  control: Control;
  commands: readonly Command[];
  strength: number;
}

/**
 * Return the inputs of all pressed controls. A control with a button held takes precedence over the control alone.
 * Commands that move no limb need a press of more than half.
 */
export function resolveControls(state: GamepadState, mapping: Mapping): ControlInput[] {
  const pressed = pressedControls(state, mapping.deadZone);
  return [...pressed].flatMap(([alone, strength]) => {
    const chord = [...pressed.keys()]
      .map((modifier) => `${modifier} ${alone}`)
      .find((combined) => combined in mapping.bindings);
    const control = chord ?? alone;
    const commands = mapping.bindings[control] ?? [];
    const isPressed = strength > PRESS_THRESHOLD || commands.some(isLimbInput);
    return isPressed && commands.length > 0 ? [{ control, commands, strength }] : [];
  });
}
