/**
 * Commands of the page's controls for limbs in another realm. Only that realm knows which limb is selected: it decides
 * what a control does that moves the selected limb and has another meaning without one. The page runs all other actions
 * of its own at once.
 */
import type { CommandInput, PageActions } from "./command-dispatcher";
import { activeCommands, type Command, type Control, isPageAction, isSelectedLimbInput } from "./mapping";

/** Message to the dispatcher of the other realm. `now` is in milliseconds. */
export type CommandMessage =
  | { type: "press"; control: Control; commands: readonly Command[]; strength: number; now: number }
  | { type: "repeat"; control: Control }
  | { type: "release"; control: Control; now: number }
  /** Release controls without the effect of a tap. */
  | { type: "release all"; controls: readonly Control[] };

export interface RemoteCommandOptions {
  /** Actions that the page runs itself. */
  actions: PageActions;
  /** True once the other realm handles commands. */
  isReady(): boolean;
  /** True if a limb is selected, as far as the page knows. It only decides which keys are left to the browser. */
  isLimbSelected(): boolean;
  send(message: CommandMessage): void;
}

interface Press {
  bound: readonly Command[];
  strength: number;
  /** True if the other realm decides which commands apply. */
  isDecidedRemotely: boolean;
}

export class RemoteCommands implements CommandInput {
  readonly #pressed = new Map<Control, Press>();

  constructor(private readonly options: RemoteCommandOptions) {}

  isDown(control: Control): boolean {
    return this.#pressed.has(control);
  }

  press(control: Control, bound: readonly Command[], strength: number, now: number): boolean {
    const { actions, isReady, send } = this.options;
    const before = this.#pressed.get(control);
    const press = {
      bound: before?.bound ?? bound,
      strength,
      isDecidedRemotely: before?.isDecidedRemotely ?? (isReady() && bound.some(isSelectedLimbInput)),
    };
    if (press.bound.length === 0) return false;
    this.#pressed.set(control, press);
    const commands = press.isDecidedRemotely
      ? press.bound
      : press.bound.filter((command) => !isPageAction(command) && !isSelectedLimbInput(command));
    if (strength !== before?.strength && commands.length > 0) send({ type: "press", control, commands, strength, now });
    if (!before) for (const action of ownActions(press)) actions[action]();
    return this.#applies(press);
  }

  repeat(control: Control): boolean {
    const press = this.#pressed.get(control);
    if (!press) return false;
    if (press.isDecidedRemotely) this.options.send({ type: "repeat", control });
    for (const action of ownActions(press))
      if (action === "back" || action === "forward") this.options.actions[action]();
    return this.#applies(press);
  }

  release(control: Control, now: number): void {
    if (this.#pressed.delete(control)) this.options.send({ type: "release", control, now });
  }

  releaseAll(matches: (control: Control) => boolean = () => true): void {
    const controls = [...this.#pressed.keys()].filter(matches);
    if (controls.length === 0) return;
    for (const control of controls) this.#pressed.delete(control);
    this.options.send({ type: "release all", controls });
  }

  #applies({ bound }: Press): boolean {
    return activeCommands(bound, this.options.isLimbSelected()).length > 0;
  }
}

/** Return the actions that the page runs without asking the other realm. */
function ownActions({ bound, isDecidedRemotely }: Press) {
  return isDecidedRemotely ? [] : bound.filter(isPageAction);
}
