/** Hears which control of a gamepad somebody means: one alone, or one with a button held. Pure. */
import { PRESS_THRESHOLD } from "./gamepad-state";
import type { Control } from "./mapping";

export class GamepadCapture {
  #wasReleased = false;
  #modifier: Control | null = null;

  /** Given all that is pressed (0 to 1) once a frame: the control meant, once that is clear. What was down before the first rest does not count. */
  update(pressed: ReadonlyMap<Control, number>): Control | null {
    const down = [...pressed].filter(([, strength]) => strength > PRESS_THRESHOLD).map(([control]) => control);
    if (!this.#wasReleased) {
      this.#wasReleased = down.length === 0;
      return null;
    }
    const first = this.#modifier ?? down.find((control) => control.startsWith("button")) ?? null;
    const other = down.find((control) => control !== first);
    if (first === null) return other ?? null;
    if (other !== undefined) return `${first} ${other}`;
    this.#modifier = first;
    // a button alone is meant when it comes up alone
    return down.length === 0 ? first : null;
  }
}
