/** Commands of the page's controls for limbs in another realm. The page runs its own actions itself, at once. */
import type { CommandInput, PageActions } from "./command-dispatcher";
import { isLimbInput } from "./digital-input";
import { activeCommands, type Command, type Control, limbOfCommand } from "./mapping";

/** Message to the dispatcher of the other realm. `now` is in milliseconds. */
export type CommandMessage =
  | { type: "press"; control: Control; commands: readonly Command[]; strength: number; now: number }
  | { type: "release"; control: Control; now: number }
  /** Release controls without the effect of a tap. */
  | { type: "release all"; controls: readonly Control[] };

export class RemoteCommands implements CommandInput {
  readonly #pressed = new Map<Control, { commands: readonly Command[]; strength: number }>();

  constructor(
    private readonly actions: PageActions,
    private readonly isLimbSelected: () => boolean,
    private readonly send: (message: CommandMessage) => void,
  ) {}

  isDown(control: Control): boolean {
    return this.#pressed.has(control);
  }

  press(control: Control, bound: readonly Command[], strength: number, now: number): boolean {
    const pressed = this.#pressed.get(control);
    const commands = pressed?.commands ?? activeCommands(bound, this.isLimbSelected());
    if (commands.length === 0) return false;
    if (strength !== pressed?.strength) this.send({ type: "press", control, commands, strength, now });
    this.#pressed.set(control, { commands, strength });
    if (pressed) return true;
    for (const command of commands)
      if (!isLimbInput(command) && limbOfCommand(command) === null) this.actions[command as keyof PageActions]();
    return true;
  }

  repeat(control: Control): void {
    for (const command of this.#pressed.get(control)?.commands ?? [])
      if (command === "back" || command === "forward") this.actions[command]();
  }

  release(control: Control, now: number): void {
    if (this.#pressed.delete(control)) this.send({ type: "release", control, now });
  }

  releaseAll(matches: (control: Control) => boolean = () => true): void {
    const controls = [...this.#pressed.keys()].filter(matches);
    if (controls.length === 0) return;
    for (const control of controls) this.#pressed.delete(control);
    this.send({ type: "release all", controls });
  }
}
