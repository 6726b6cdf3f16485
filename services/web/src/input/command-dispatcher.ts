/** Carries out what a control is bound to, whichever device it is of. */

import { isLimbInput } from "./digital-input";
import type { LimbController } from "./limb-controller";
import { type Action, activeCommands, type Command, type Control, limbOfCommand } from "./mapping";
import type { VelocityInputs } from "./velocity-input";

/** A control held longer than this lets its limb go when it comes up; a shorter press leaves the limb held. Milliseconds. */
const LONG_PRESS_MS = 400;

/** What the page does for each action that takes no limb. */
export type PageActions = Readonly<Record<Exclude<Action, `take_${string}`>, () => void>>;

interface Press {
  commands: readonly Command[];
  pressedAt: number;
  /** Limbs that it is about, and those of them that it took: of who was chosen as it went down. */
  limbs: readonly number[];
  claimedLimbs: readonly number[];
}

export class CommandDispatcher {
  readonly #pressed = new Map<Control, Press>();

  constructor(
    private readonly limbController: LimbController,
    private readonly velocity: VelocityInputs,
    private readonly actions: PageActions,
  ) {}

  /** Whether a control is down. */
  isDown(control: Control): boolean {
    return this.#pressed.has(control);
  }

  /** A control goes down, or is pressed more or less than before; `now` in milliseconds. Whether it means anything now, of what it is `bound` to. */
  press(control: Control, bound: readonly Command[], strength: number, now: number): boolean {
    const pressed = this.#pressed.get(control);
    const commands = pressed?.commands ?? activeCommands(bound, this.velocity.selectedLimb !== null);
    for (const command of commands) if (isLimbInput(command)) this.velocity.set(control, command, strength);
    if (pressed || commands.length === 0) return commands.length > 0;
    const limbs = commands
      .map(limbOfCommand)
      .filter((part) => part !== null)
      .map((part) => this.velocity.limb(part));
    const took = limbs.filter(
      (limb) =>
        this.limbController.source(limb) !== "pointer" && !this.velocity.holds(limb) && this.velocity.hold(limb),
    );
    this.#pressed.set(control, { commands, pressedAt: now, limbs, claimedLimbs: took });
    for (const command of commands)
      if (!isLimbInput(command) && limbOfCommand(command) === null) this.actions[command as keyof PageActions]();
    return true;
  }

  /** A control that is down repeats by itself: seeking goes on, the rest is done once. */
  repeat(control: Control): void {
    for (const command of this.#pressed.get(control)?.commands ?? [])
      if (command === "back" || command === "forward") this.actions[command]();
  }

  /** A control comes up. */
  release(control: Control, now: number): void {
    const press = this.#pressed.get(control);
    this.#pressed.delete(control);
    if (!press) return;
    this.#clearInputs(control, press);
    const long = now - press.pressedAt > LONG_PRESS_MS;
    // A tap takes and the next tap lets go; a long press holds for as long as it lasts.
    for (const limb of press.limbs) if (long || !press.claimedLimbs.includes(limb)) this.velocity.release(limb);
  }

  /** Lets all controls up whose names pass, without a tap's meaning. */
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
