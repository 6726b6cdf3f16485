/** Buttons and thumbstick of a controller with the layout `xr-standard` (WebXR Gamepads Module, 3.3). Pure. */
import { Threshold } from "./threshold";

/** What hands do in an immersive session other than holding strings. */
export type ImmersiveAction = "next performer" | "size" | "turn left" | "turn right";

/** Part of the Gamepad interface that is read. */
export interface ControllerState {
  readonly axes: readonly number[];
  readonly buttons: readonly { readonly value: number }[];
}

/** Index of the buttons: trigger and squeeze close the hand. */
const TRIGGER = 0;
const SQUEEZE = 1;
const BUTTON_ACTIONS: readonly (readonly [button: number, action: ImmersiveAction])[] = [
  [3, "next performer"],
  [4, "next performer"],
  [5, "size"],
];
/** Axis of the thumbstick to the right. */
const STICK_X = 2;

/** Values at which a button or a stick counts as pressed, and as released. */
const BUTTON = [0.5, 0.3] as const;
const STICK = [0.7, 0.4] as const;

export class Controller {
  readonly #trigger = new Threshold(...BUTTON);
  readonly #squeeze = new Threshold(...BUTTON);
  readonly #buttons = BUTTON_ACTIONS.map(() => new Threshold(...BUTTON));
  readonly #left = new Threshold(...STICK);
  readonly #right = new Threshold(...STICK);

  /** True while trigger or squeeze is pressed. */
  get isClosed(): boolean {
    return this.#trigger.isOn || this.#squeeze.isOn;
  }

  /** Read the controller, once per frame. Return the actions that begin now. */
  update({ axes, buttons }: ControllerState): ImmersiveAction[] {
    this.#trigger.update(buttons[TRIGGER]?.value ?? 0);
    this.#squeeze.update(buttons[SQUEEZE]?.value ?? 0);
    const actions = BUTTON_ACTIONS.flatMap(([button, action], nth): ImmersiveAction[] =>
      this.#buttons[nth].update(buttons[button]?.value ?? 0) ? [action] : [],
    );
    const x = axes[STICK_X] ?? 0;
    if (this.#left.update(-x)) actions.push("turn left");
    if (this.#right.update(x)) actions.push("turn right");
    return actions;
  }
}
