/** Detection of the gamepad control that the user wants to bind: one alone, or one with a button held. Pure. */
import { PRESS_THRESHOLD } from "./gamepad-state";
import type { Control } from "./mapping";

export class GamepadCapture {
  #wasReleased = false;
  #modifier: Control | null = null;

  /**
   * Pass all pressed controls (0 to 1) once per frame. Return the chosen control once it is unambiguous. Controls
   * pressed before everything was released are ignored.
   */
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
    // A button counts alone when it is released alone.
    return down.length === 0 ? first : null;
  }
}
