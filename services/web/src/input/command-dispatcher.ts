/** Dispatcher of the commands that controls of any device are bound to. */

import { isLimbInput } from "./digital-input";
import type { LimbController } from "./limb-controller";
import {
  ACTIONS,
  activeCommands,
  type Command,
  type Control,
  isPageAction,
  limbOfCommand,
  type PageAction,
} from "./mapping";
import type { VelocityInputs } from "./velocity-input";

/**
 * A press longer than this releases its limb when the control is released; after a shorter one the limb stays held, in
 * milliseconds.
 */
const LONG_PRESS_MS = 400;

/** Functions of the page for the actions that claim no limb. */
export type PageActions = Readonly<Record<PageAction, () => void>>;

/** Create page actions that all call `run`. */
export function createPageActions(run: (action: PageAction) => void): PageActions {
  return Object.fromEntries(
    ACTIONS.filter(isPageAction).map((action) => [action, () => run(action)]),
  ) as unknown as PageActions;
}

/** Commands of the controls of all devices. */
export interface CommandInput {
  isDown(control: Control): boolean;
  /**
   * Press a control, or change the strength of the press. `now` is in milliseconds. Return whether any command in
   * `bound` applies now.
   */
  press(control: Control, bound: readonly Command[], strength: number, now: number): boolean;
  /**
   * Handle automatic repetition: seeking repeats, other commands do not. Return whether any command of the control
   * applies now.
   */
  repeat(control: Control): boolean;
  release(control: Control, now: number): void;
  /** Release all controls that match, without the effect of a tap. */
  releaseAll(matches?: (control: Control) => boolean): void;
}

interface Press {
  commands: readonly Command[];
  pressedAt: number;
  /**
   * Limbs that the commands refer to, and those among them that the press claimed. They belong to the performer
   * selected at the time.
   */
  limbs: readonly number[];
  claimedLimbs: readonly number[];
}

export class CommandDispatcher implements CommandInput {
  readonly #pressed = new Map<Control, Press>();

  constructor(
    private readonly limbController: LimbController,
    private readonly velocity: VelocityInputs,
    private readonly actions: PageActions,
  ) {}

  isDown(control: Control): boolean {
    return this.#pressed.has(control);
  }

  press(control: Control, bound: readonly Command[], strength: number, now: number): boolean {
    const pressed = this.#pressed.get(control);
    const commands = pressed?.commands ?? activeCommands(bound, this.velocity.selectedLimb !== null);
    for (const command of commands) if (isLimbInput(command)) this.velocity.set(control, command, strength);
    if (pressed || commands.length === 0) return commands.length > 0;
    const limbs = commands
      .map(limbOfCommand)
      .filter((index) => index !== null)
      .map((index) => this.velocity.limb(index));
    const claimed = limbs.filter(
      (limb) =>
        this.limbController.source(limb) !== "pointer" && !this.velocity.holds(limb) && this.velocity.hold(limb),
    );
    this.#pressed.set(control, { commands, pressedAt: now, limbs, claimedLimbs: claimed });
    for (const action of commands.filter(isPageAction)) this.actions[action]();
    return true;
  }

  repeat(control: Control): boolean {
    for (const command of this.#pressed.get(control)?.commands ?? [])
      if (command === "back" || command === "forward") this.actions[command]();
    return this.isDown(control);
  }

  release(control: Control, now: number): void {
    const press = this.#pressed.get(control);
    this.#pressed.delete(control);
    if (!press) return;
    this.#clearInputs(control, press);
    const long = now - press.pressedAt > LONG_PRESS_MS;
    // A tap claims and the next tap releases; a long press holds until it ends.
    for (const limb of press.limbs) if (long || !press.claimedLimbs.includes(limb)) this.velocity.release(limb);
  }

  releaseAll(matches: (control: Control) => boolean = () => true): void {
    for (const [control, press] of this.#pressed) {
      if (!matches(control)) continue;
      this.#pressed.delete(control);
      this.#clearInputs(control, press);
    }
  }

  #clearInputs(control: Control, { commands }: Press): void {
    for (const command of commands) if (isLimbInput(command)) this.velocity.set(control, command, 0);
  }
}
